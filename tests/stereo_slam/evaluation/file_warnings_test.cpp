// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/file_warnings.hpp"

#include <cmath>

#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

using Stamps = std::vector<std::int64_t>;

/// A path with bends; `offset_m` makes it another one, bent by a centimetre.
Trajectory curve(std::size_t count, double scale = 1.0, double offset_m = 0.0) {
  Trajectory trajectory;
  for (std::size_t i = 0; i < count; ++i) {
    const double s = 0.1 * static_cast<double>(i);
    const Eigen::Vector3d p(s, 3.0 * std::sin(0.4 * s), offset_m * std::sin(1.7 * s));
    trajectory.poses.push_back(Eigen::Translation3d(scale * p) *
                               Eigen::AngleAxisd(0.3 * std::sin(0.4 * s), Eigen::Vector3d::UnitZ()));
  }
  return trajectory;
}

std::vector<std::string> warnings(const Trajectory& truth, const Trajectory& estimate) {
  return file_warnings({"truth.txt", truth}, {"estimate.txt", estimate}, match_poses(truth, estimate));
}

/// The only warning.
std::string warning(const Trajectory& truth, const Trajectory& estimate) {
  const auto all = warnings(truth, estimate);
  CAPTURE(all);
  REQUIRE(all.size() == 1);
  return all[0];
}

Stamps stamps(std::size_t count, std::int64_t step_ns) {
  Stamps result;
  for (std::size_t i = 0; i < count; ++i) result.push_back(static_cast<std::int64_t>(i) * step_ns);
  return result;
}

}  // namespace

TEST_CASE("An ordinary estimate draws no warning", "[file_warnings]") {
  CHECK(warnings(curve(200), curve(200, 1.0, 0.01)).empty());
  CHECK(warnings(curve(200), curve(200, 1.02, 0.01)).empty());
  Trajectory truth = curve(200);
  Trajectory estimate = curve(20, 1.0, 0.01);  // 20 Hz in 200 Hz
  for (std::size_t i = 0; i < 20; ++i) estimate.poses[i] = curve(200, 1.0, 0.01).poses[10 * i];
  truth.stamps_ns = stamps(200, 5'000'000);
  estimate.stamps_ns = stamps(20, 50'000'000);
  CHECK(warnings(truth, estimate).empty());
}

TEST_CASE("Remarks on the reading name their file", "[file_warnings]") {
  Trajectory estimate = curve(200, 1.0, 0.01);
  estimate.remarks = {"its stamps are odd"};
  CHECK(warning(curve(200), estimate) == "estimate.txt: its stamps are odd");
}

TEST_CASE("Different lengths without stamps are named", "[file_warnings]") {
  CHECK_THAT(warning(curve(200), curve(150, 1.0, 0.01)),
             Catch::Contains("200 ground-truth and 150 estimated poses"));
}

TEST_CASE("The same poses in both files are named", "[file_warnings]") {
  CHECK_THAT(warning(curve(200), curve(200)), Catch::Contains("exactly the poses of the ground truth"));
}

TEST_CASE("A ground truth of positions only is named", "[file_warnings]") {
  Trajectory truth = curve(200);
  for (auto& pose : truth.poses) pose.linear().setIdentity();
  CHECK_THAT(warning(truth, curve(200, 1.0, 0.01)),
             Catch::Contains("rotations of the ground truth are all the same"));
  CHECK_THAT(warning(curve(200, 1.0, 0.01), truth),
             Catch::Contains("rotations of the estimate are all the same"));
}

TEST_CASE("An estimate of another scale is named, with the scale", "[file_warnings]") {
  CHECK_THAT(warning(curve(200), curve(200, 0.25, 0.01)), Catch::Contains("after scaling by 4"));
}

TEST_CASE("Few matches are named with the ranges of the stamps", "[file_warnings]") {
  Trajectory truth = curve(200);
  Trajectory estimate = curve(200, 1.0, 0.01);
  truth.stamps_ns = stamps(200, 50'000'000);
  estimate.stamps_ns =
      stamps(200, 250'000'000);  // five times slower: every fifth pose of the truth has a partner
  const auto all = warnings(truth, estimate);
  REQUIRE_FALSE(all.empty());
  CHECK_THAT(all[0],
             Catch::Contains("only 40 of 200 ground-truth and 200 estimated poses match; ground truth: "
                             "0.000000000 to 9.950000000 s, estimate: 0.000000000 to 49.750000000 s"));
}

TEST_CASE("Stamps that occur twice with distant poses are named", "[file_warnings]") {
  Trajectory truth = curve(200);
  Trajectory estimate = curve(200, 1.0, 0.01);
  truth.stamps_ns = estimate.stamps_ns = stamps(200, 50'000'000);
  estimate.stamps_ns[10] = estimate.stamps_ns[9];
  CHECK_THAT(warning(truth, estimate),
             Catch::Contains("estimate.txt: 1 pose has the stamp of the pose before"));
}

TEST_CASE("Other conventions are named", "[file_warnings]") {
  Trajectory estimate = curve(200, 1.0, 0.01);
  for (auto& pose : estimate.poses) pose = pose * Eigen::AngleAxisd(1.57, Eigen::Vector3d::UnitY());
  CHECK_THAT(warning(curve(200), estimate), Catch::Contains("do not mean the same by a pose"));
}

TEST_CASE("Inverse poses are not taken for another scale, and both are named if both are there",
          "[file_warnings]") {
  Trajectory inverse = curve(200, 1.0, 0.01);
  for (auto& pose : inverse.poses) pose = pose.inverse();
  CHECK_THAT(warning(curve(200), inverse), Catch::Contains("the poses of the estimate are inverted"));
  Trajectory turned = curve(200, 0.25, 0.01);
  for (auto& pose : turned.poses) pose = pose * Eigen::AngleAxisd(1.57, Eigen::Vector3d::UnitY());
  const auto both = warnings(curve(200), turned);
  REQUIRE(both.size() == 2);
  CHECK_THAT(both[0], Catch::Contains("after scaling by 4"));
  CHECK_THAT(both[1], Catch::Contains("do not mean the same by a pose"));
}

TEST_CASE("Poses of a body that was lost are named with their file and stamp", "[file_warnings]") {
  Trajectory truth = curve(200);
  truth.stamps_ns = stamps(200, 50'000'000);
  Trajectory estimate = curve(200, 1.0, 0.01);
  estimate.stamps_ns = truth.stamps_ns;
  for (const std::size_t lost : {100, 101}) truth.poses[lost].setIdentity();
  CHECK_THAT(warning(truth, estimate),
             Catch::Contains("truth.txt: the pose at 5.000000000 s is 10.") &&
                 Catch::Contains("while the estimate moves by 0.1") &&
                 Catch::Contains("and 1 more jump like it; remove the poses of a body that was lost"));
}

TEST_CASE("Clocks that differ are named, and not taken for other conventions", "[file_warnings]") {
  Trajectory truth = curve(300);
  Trajectory estimate = curve(300, 1.0, 0.01);
  truth.stamps_ns = estimate.stamps_ns = stamps(300, 50'000'000);
  for (auto& stamp_ns : estimate.stamps_ns) stamp_ns += 1'000'000'000;
  CHECK_THAT(warning(truth, estimate), Catch::Contains("shows the motion of the ground truth 1 s later") &&
                                           Catch::Contains("check both clocks"));
}
