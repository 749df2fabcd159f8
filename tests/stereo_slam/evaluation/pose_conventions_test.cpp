// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/pose_conventions.hpp"

#include <cmath>
#include <random>

#include <Eigen/Geometry>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

using Path = std::vector<Eigen::Isometry3d>;

/// A path that turns about all axes while it moves.
Path hand_held(std::size_t count) {
  Path path;
  for (std::size_t i = 0; i < count; ++i) {
    const double s = 0.05 * static_cast<double>(i);
    const Eigen::Vector3d p(3.0 * std::sin(0.31 * s), 2.0 * std::cos(0.47 * s), 0.6 * std::sin(0.83 * s));
    path.push_back(Eigen::Translation3d(p) *
                   Eigen::AngleAxisd(1.1 * std::sin(0.37 * s) + 0.3 * s, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(0.8 * std::sin(0.59 * s), Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(0.7 * std::cos(0.71 * s), Eigen::Vector3d::UnitX()));
  }
  return path;
}

/// A drive on level ground, the camera looking along z.
Path drive_with_bends(std::size_t count, double bend_rad) {
  Path path{Eigen::Isometry3d::Identity()};
  while (path.size() < count) {
    const double k = static_cast<double>(path.size());
    path.push_back(path.back() * Eigen::Translation3d(0.0, 0.0, 1.0) *
                   Eigen::AngleAxisd(bend_rad * std::sin(0.03 * k), Eigen::Vector3d::UnitY()));
  }
  return path;
}

Path disturbed(Path path, double sigma_m, double sigma_rad) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  for (auto& pose : path) {
    const Eigen::Vector3d turn = sigma_rad * vector();
    pose =
        pose * Eigen::Translation3d(sigma_m * vector()) * Eigen::AngleAxisd(turn.norm(), turn.normalized());
  }
  return path;
}

const Eigen::Isometry3d kElsewhere =
    Eigen::Translation3d(30, -4, 7) * Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, 2, -1).normalized());

/// The camera in the body, as on EuRoC's drone.
const Eigen::Isometry3d kCameraInBody = Eigen::Translation3d(-0.02, -0.06, 0.01) *
                                        Eigen::AngleAxisd(1.57, Eigen::Vector3d(0.02, -0.01, 1).normalized());

template <class Change>
Path changed_by(const Change& change, const Path& path) {
  Path result;
  for (const auto& pose : path) result.push_back(change(pose));
  return result;
}

Path after(const Path& path, const Eigen::Isometry3d& T) {
  return changed_by([&](const Eigen::Isometry3d& pose) { return pose * T; }, path);
}

Path elsewhere(const Path& path) {
  return changed_by([](const Eigen::Isometry3d& pose) { return kElsewhere * pose; }, path);
}

Eigen::Isometry3d inverted(const Eigen::Isometry3d& pose) { return pose.inverse(); }

Eigen::Isometry3d rotation_inverted(const Eigen::Isometry3d& pose) {
  return Eigen::Translation3d(pose.translation()) * Eigen::Quaterniond(pose.linear()).conjugate();
}

/// A pose that is written with qw last, and read with qw first.
Eigen::Isometry3d read_scalar_first(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond q(pose.linear());
  return Eigen::Translation3d(pose.translation()) * Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w());
}

Eigen::Isometry3d read_scalar_last(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond q(pose.linear());
  return Eigen::Translation3d(pose.translation()) * Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y());
}

/// In left-handed axes, as game engines have them: y and z are swapped.
Eigen::Isometry3d left_handed(const Eigen::Isometry3d& pose) {
  Eigen::Matrix3d S;
  S << 1, 0, 0, 0, 0, 1, 0, 1, 0;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = S * pose.linear() * S;
  T.translation() = S * pose.translation();
  return T;
}

/// The better fit of a pair of files; their noise is a few per cent of the motions.
ConventionFit found(const Path& truth, const Path& estimate) {
  const auto finding = find_conventions({truth, estimate});
  REQUIRE(finding);
  CAPTURE(describe(*finding));
  CHECK(finding->better.translation_error < 0.1);
  return finding->better;
}

constexpr double kSigma_m = 0.002;
constexpr double kSigma_rad = 0.002;

}  // namespace

TEST_CASE("Files of the same conventions agree, wherever they start and whatever their scale",
          "[conventions]") {
  for (const Path& path : {hand_held(400), drive_with_bends(400, 0.02), drive_with_bends(400, 0.0)}) {
    const Path estimate = elsewhere(disturbed(path, kSigma_m, kSigma_rad));
    CHECK_FALSE(find_conventions({path, path}));
    CHECK_FALSE(find_conventions({path, estimate}));
    CHECK_FALSE(find_conventions({path, disturbed(path, 0.3, 0.1)}));
    const Path scaled = changed_by(
        [](Eigen::Isometry3d pose) {
          pose.translation() *= 0.3;
          return pose;
        },
        estimate);
    CHECK_FALSE(find_conventions({path, scaled}));
  }
}

TEST_CASE("A camera compared with its body is found, with the lever arm", "[conventions]") {
  const Path truth = hand_held(400);
  const Path estimate = elsewhere(disturbed(after(truth, kCameraInBody), kSigma_m, kSigma_rad));
  const auto finding = find_conventions({truth, estimate});
  REQUIRE(finding);
  CHECK(finding->better.change == PoseChange::kNone);
  CHECK(finding->better.offset == FrameOffset::kBody);
  const Eigen::Isometry3d error = finding->better.T_truth_estimate.inverse() * kCameraInBody;
  CHECK(error.translation().norm() < 10.0 * kSigma_m);  // ten times the noise of one pose; there are 400
  CHECK(Eigen::AngleAxisd(error.linear()).angle() < 10.0 * kSigma_rad);
  CHECK(finding->ate_better_m < 0.1 * finding->ate_as_given_m);
  CHECK_THAT(describe(*finding),
             Catch::Contains("turned by 90.0 degrees") && Catch::Contains("--pose-frame body"));
}

TEST_CASE("A camera that looks backwards is found on a straight road", "[conventions]") {
  const Path truth = drive_with_bends(300, 0.0);
  const Eigen::Isometry3d backwards(Eigen::AngleAxisd(1.5, Eigen::Vector3d::UnitY()));
  CHECK(found(truth, disturbed(after(truth, backwards), kSigma_m, kSigma_rad)).offset == FrameOffset::kBody);
}

TEST_CASE("Bodies with other origins only are told from those with other axes", "[conventions]") {
  const Path truth = hand_held(400);
  const Eigen::Isometry3d moved(Eigen::Translation3d(0.8, -0.3, 0.5));
  const auto fit = found(truth, elsewhere(disturbed(after(truth, moved), kSigma_m, kSigma_rad)));
  CHECK(fit.offset == FrameOffset::kOrigin);
  CHECK((fit.T_truth_estimate.translation() - moved.translation()).norm() < 10.0 * kSigma_m);
}

TEST_CASE("Quaternions in the other order are found, in either file", "[conventions]") {
  for (const Path& truth : {elsewhere(hand_held(400)), elsewhere(drive_with_bends(400, 0.02))}) {
    const Path estimate = elsewhere(disturbed(truth, kSigma_m, kSigma_rad));
    const auto first = found(truth, changed_by(read_scalar_first, estimate));
    CHECK(first.change == PoseChange::kScalarLast);
    CHECK(first.offset == FrameOffset::kNone);
    CHECK_FALSE(first.of_truth);
    CHECK(found(truth, changed_by(read_scalar_last, estimate)).change == PoseChange::kScalarFirst);
    const auto of_truth = found(changed_by(read_scalar_first, truth), estimate);
    CHECK(of_truth.change == PoseChange::kScalarLast);
    CHECK(of_truth.of_truth);
  }
}

TEST_CASE("Inverse poses and inverse rotations are found, with another body as well", "[conventions]") {
  for (const Path& truth : {hand_held(400), drive_with_bends(400, 0.02)}) {
    const Path estimate = elsewhere(disturbed(truth, kSigma_m, kSigma_rad));
    CHECK(found(truth, changed_by(inverted, estimate)).change == PoseChange::kInverse);
    CHECK(found(truth, changed_by(rotation_inverted, estimate)).change == PoseChange::kInverseRotation);
  }
  const Path truth = hand_held(400);
  const Path camera = elsewhere(disturbed(after(truth, kCameraInBody), kSigma_m, kSigma_rad));
  const auto fit = found(truth, changed_by(inverted, camera));
  CHECK(fit.change == PoseChange::kInverse);
  CHECK(fit.offset == FrameOffset::kBody);
}

TEST_CASE("Left-handed axes are found", "[conventions]") {
  const Path truth = hand_held(400);
  const Path estimate = disturbed(truth, kSigma_m, kSigma_rad);
  CHECK(found(truth, changed_by(left_handed, estimate)).change == PoseChange::kMirror);
}

TEST_CASE("Positions in other axes than the rotations are found", "[conventions]") {
  const Path truth = hand_held(400);
  const Path estimate = disturbed(truth, kSigma_m, kSigma_rad);
  for (const double sign : {1.0, -1.0}) {
    const auto fit = found(truth, changed_by(
                                      [sign](Eigen::Isometry3d pose) {  // x and y swapped, z down or up
                                        const Eigen::Vector3d t = pose.translation();
                                        pose.translation() = Eigen::Vector3d(t.y(), t.x(), -sign * t.z());
                                        return pose;
                                      },
                                      estimate));
    CHECK(fit.change == PoseChange::kNone);
    CHECK(fit.offset == FrameOffset::kPositions);
    CHECK(fit.axes.determinant() * sign > 0.0);
  }
}

TEST_CASE("A few wrong poses hide no difference, and make none", "[conventions]") {
  const Path truth = hand_held(400);
  const auto with_jump = [](Path path) {
    for (std::size_t i = 200; i < path.size(); ++i) path[i] = kElsewhere * path[i];
    return path;
  };
  CHECK_FALSE(find_conventions({truth, with_jump(disturbed(truth, kSigma_m, kSigma_rad))}));
  CHECK(find_conventions({truth, with_jump(disturbed(after(truth, kCameraInBody), kSigma_m, kSigma_rad))}));
}

TEST_CASE("Published estimates have the conventions of their ground truth", "[conventions][data]") {
  const auto data = data_folder();
  if (!data) return;
  const auto poses_of = [&](const std::string& truth, const std::string& estimate) {
    const Trajectory a = read_trajectory(*data / "trajectories" / truth);
    const Trajectory b = read_trajectory(*data / "trajectories" / estimate);
    return poses_of_pairs(a, b, match_poses(a, b));
  };
  for (const char* name :
       {"00/estimate_orbslam2_stereo.txt", "00/estimate_sptam.txt", "04/estimate_orbslam2_stereo.txt",
        "07/estimate_orbslam2_stereo.txt", "10/estimate_orbslam2_stereo.txt"}) {
    const std::string estimate = "kitti/" + std::string(name);
    CAPTURE(estimate);
    const std::string truth = estimate.substr(0, 9) + "poses.txt";
    PosePairs poses = poses_of(truth, estimate);
    CHECK_FALSE(find_conventions(poses));
    for (auto& pose : poses.estimate) pose = pose * kCameraInBody;
    CHECK(find_conventions(poses)->better.offset == FrameOffset::kBody);
  }
  PosePairs poses = poses_of("euroc/V1_02_groundtruth.csv", "euroc/V1_02_estimate.txt");
  CHECK_FALSE(find_conventions(poses));
  for (auto& pose : poses.estimate) pose = pose.inverse();
  CHECK(find_conventions(poses)->better.change == PoseChange::kInverse);
}

TEST_CASE("Too few poses, or poses that stand still, tell nothing", "[conventions]") {
  const Path truth = hand_held(8);
  CHECK_FALSE(find_conventions({truth, after(truth, kCameraInBody)}));
  CHECK_FALSE(find_conventions({{}, {}}));
  const Path still(100, Eigen::Isometry3d::Identity());
  CHECK_FALSE(find_conventions({still, after(still, kCameraInBody)}));
  CHECK_FALSE(find_conventions({hand_held(100), still}));
  CHECK_FALSE(find_conventions({still, hand_held(100)}));
}
