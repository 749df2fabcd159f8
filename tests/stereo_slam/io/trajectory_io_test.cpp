// SPDX-License-Identifier: MIT
#include "stereo_slam/io/trajectory_io.hpp"

#include <random>
#include <sstream>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// Random walk that turns all the way round.
std::vector<Pose> random_poses(std::size_t count) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::vector<Pose> poses;
  Pose pose = Pose::identity();
  for (std::size_t i = 0; i < count; ++i) {
    antipode::Vector6<double> xi;
    for (auto& x : xi) x = normal(random);
    poses.push_back(pose = (pose * Pose::exp(xi)).renormalized());
  }
  return poses;
}

template <class Write>
Trajectory round_trip(const Write& write) {
  const TemporaryFolder folder;
  std::ostringstream text;
  write(text);
  write_text(folder / "t.txt", text.str());
  return read_trajectory(folder / "t.txt");
}

std::string read_error(const std::string& text, std::optional<TrajectoryFormat> format = std::nullopt) {
  const TemporaryFolder folder;
  write_text(folder / "t.txt", text);
  return message_of([&] { (void)read_trajectory(folder / "t.txt", format); });
}

}  // namespace

TEST_CASE("A KITTI trajectory survives writing and reading", "[trajectory]") {
  const auto poses = random_poses(100);
  const auto read = round_trip([&](auto& out) { write_kitti_trajectory(out, poses); });
  CHECK(read.format == TrajectoryFormat::kKitti);
  CHECK(read.stamps_ns.empty());
  REQUIRE(read.poses.size() == poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double scale = 1.0 + poses[i].translation().norm();
    CHECK((read.poses[i].matrix() - poses[i].isometry().matrix()).norm() < 1e-11 * scale);
  }
}

TEST_CASE("A TUM trajectory survives writing and reading, with its stamps to the nanosecond",
          "[trajectory]") {
  const auto poses = random_poses(100);
  std::vector<std::int64_t> stamps_ns;
  for (std::size_t i = 0; i < poses.size(); ++i)
    stamps_ns.push_back(1403715524907143168 + 50'000'001 * static_cast<std::int64_t>(i));
  const auto read = round_trip([&](auto& out) { write_tum_trajectory(out, stamps_ns, poses); });
  CHECK(read.format == TrajectoryFormat::kTum);
  CHECK(read.stamps_ns == stamps_ns);
  REQUIRE(read.poses.size() == poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double scale = 1.0 + poses[i].translation().norm();
    CHECK((read.poses[i].matrix() - poses[i].isometry().matrix()).norm() < 1e-11 * scale);
  }
}

TEST_CASE("A pose and its antipode are written as the same text", "[trajectory]") {
  for (const auto& pose : random_poses(20)) {
    const Pose antipode = Pose::unchecked(-pose.coeffs());
    const std::int64_t stamp_ns = 0;
    std::ostringstream a;
    std::ostringstream b;
    write_tum_trajectory(a, {&stamp_ns, 1}, {&pose, 1});
    write_tum_trajectory(b, {&stamp_ns, 1}, {&antipode, 1});
    CHECK(a.str() == b.str());
  }
}

TEST_CASE("An EuRoC ground truth is read with its scalar-first quaternion and spare columns",
          "[trajectory]") {
  const TemporaryFolder folder;
  write_text(folder / "gt.csv",
             "#timestamp, p_x, p_y, p_z, q_w, q_x, q_y, q_z, v\n"
             "1403715524907143168,1,2,3,0.70710678,0,0,0.70710678,9\r\n");
  const auto read = read_trajectory(folder / "gt.csv");
  CHECK(read.format == TrajectoryFormat::kEuroc);
  CHECK(read.stamps_ns == std::vector<std::int64_t>{1403715524907143168});
  const Eigen::Vector3d turned = read.poses.at(0).linear() * Eigen::Vector3d::UnitX();
  CHECK((turned - Eigen::Vector3d::UnitY()).norm() < 1e-12);
  CHECK(read.poses[0].translation() == Eigen::Vector3d(1, 2, 3));
}

TEST_CASE("The numbers of a KITTI trajectory may be separated by commas", "[trajectory]") {
  const TemporaryFolder folder;
  write_text(folder / "a.txt", "1, 0, 0, 5, 0, 1, 0, 6, 0, 0, 1, 7\n");
  const auto read = read_trajectory(folder / "a.txt");
  CHECK(read.format == TrajectoryFormat::kKitti);
  CHECK(read.poses.at(0).translation() == Eigen::Vector3d(5, 6, 7));
}

TEST_CASE("A broken trajectory is refused with file, line and reason", "[trajectory]") {
  const std::string kitti = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  CHECK_THAT(read_error(""), Catch::EndsWith("t.txt: contains no poses"));
  CHECK_THAT(read_error("1 2 3\n"), Catch::Contains("t.txt:1: 3 fields are neither KITTI (12)"));
  CHECK_THAT(read_error(kitti + "1 0 0\n"), Catch::Contains("t.txt:2: 3 fields, but the first row has 12"));
  CHECK_THAT(read_error(kitti + "1 0 0 0 0 1 0 nan 0 0 1 0\n"),
             Catch::Contains("t.txt:2: 'nan' is not a finite number"));
  CHECK_THAT(read_error("1 0 0 0 0 1 0 0 0 0 -1 0\n"), Catch::Contains("not a rotation matrix"));
  CHECK_THAT(read_error("1 0 0 0 0 2 0 0 0 0 1 0\n"), Catch::Contains("not a rotation matrix"));
  CHECK_THAT(read_error("0 1 2 3 0 0 0 0\n"), Catch::Contains("t.txt:1: the quaternion has length 0, not 1"));
  CHECK_THAT(read_error("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n"),
             Catch::Contains("t.txt:2: stamp 1 is earlier"));
  CHECK(read_error("2 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n").empty());
  CHECK(read_error("2 1e-400 0 0 0 0 0 1\n").empty());
  CHECK_THAT(read_error("2 1e400 0 0 0 0 0 1\n"), Catch::Contains("t.txt:1: '1e400' is not a finite number"));
  CHECK_THAT(read_error("2,5 0,1 0,0 0,0 1,0 0,0 0,0 0,0\n"),
             Catch::Contains("t.txt:1: its numbers have decimal commas; write them with decimal points"));
  CHECK_THAT(read_error("2;0,1;0;0;0;0;0;1\n"), Catch::Contains("t.txt:1: its numbers have decimal commas"));
  CHECK_THAT(read_error("2024-05-01 12:00:00,0,0,0,1,0,0,0\n"),
             Catch::Contains("t.txt:1: '2024-05-01 12:00:00' is not a stamp in numbers"));
  CHECK_THAT(read_error(kitti, TrajectoryFormat::kTum), Catch::Contains("12 fields, but TUM has 8"));
}

TEST_CASE("A trajectory without a last line end is read if its last row is whole", "[trajectory]") {
  const std::string first = "0.5 1.25 2.25 3.25 0.0 0.0 0.0 1.0\n";
  const std::string second = "0.6 1.50 2.50 3.50 0.0 0.0 0.6 0.8";
  CHECK(read_error(first + second).empty());
  CHECK(read_error(second).empty());
  CHECK(read_error("0.5,1,2,3,0,0,0,1\n0.6,1,2,3,0,0,0,1").empty());
  for (std::size_t kept = 1; kept < second.size(); ++kept) {
    CAPTURE(kept);
    CHECK_THAT(read_error(first + second.substr(0, kept)),
               Catch::Contains("t.txt:2: ") && Catch::Contains("the last line has no line end"));
  }
}
