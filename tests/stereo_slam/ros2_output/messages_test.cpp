// SPDX-License-Identifier: MIT
#include "stereo_slam/ros2_output/messages.hpp"

#include <array>
#include <map>

#include <antipode/distributions/covariance_conventions.hpp>

#include "stereo_slam/bags/message_fields.hpp"
#include "stereo_slam/ros2_output/message_definitions.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr std::int64_t kStamp_ns = 1'700'000'000'123'456'789;

[[nodiscard]] PoseGaussian uncertain_pose() {
  Matrix6<double> A;
  for (int i = 0; i < 36; ++i) A(i / 6, i % 6) = 0.01 * ((7 * i) % 11 - 5);
  return {car_motion(), A * A.transpose()};
}

[[nodiscard]] MessageFields fields_of(const CdrMessage& message) { return {message, Serialization::kCdr}; }

void check_header(MessageFields& fields, std::string_view frame) {
  CHECK(fields.stamp_ns() == kStamp_ns);
  CHECK(fields.text() == frame);
}

void check_pose(MessageFields& fields, const Pose& pose) {
  std::array<double, 7> numbers{};
  fields.fill(numbers);
  const auto& [x, y, z, qx, qy, qz, qw] = numbers;
  const Pose read =
      Pose::from_matrix(Eigen::Quaterniond(qw, qx, qy, qz).toRotationMatrix(), Vector3<double>(x, y, z));
  CHECK(read.is_approx(pose, 1e-14));
}

}  // namespace

TEST_CASE("An Odometry has the pose, the covariance in the order of ROS, and the velocity", "[ros2]") {
  const PoseGaussian pose = uncertain_pose();
  Vector6<double> velocity;
  velocity << 0.1, 0.2, 0.3, 4.0, 5.0, 6.0;  // angular first
  Matrix6<double> P = Matrix6<double>::Identity();
  P(0, 3) = P(3, 0) = 0.25;
  P(0, 0) = 9.0;
  const auto message = odometry_message({{kStamp_ns, "odom"}, "base_link", pose, velocity, P});
  auto fields = fields_of(message);
  check_header(fields, "odom");
  CHECK(fields.text() == "base_link");
  check_pose(fields, pose.pose);
  std::array<double, 36> covariance{};
  fields.fill(covariance);
  CHECK(covariance == antipode::to_ros_covariance(pose));
  std::array<double, 6> twist{};
  fields.fill(twist);
  CHECK(twist == std::array{4.0, 5.0, 6.0, 0.1, 0.2, 0.3});
  fields.fill(covariance);
  CHECK(covariance[0] == 1.0);   // of the velocity along x
  CHECK(covariance[21] == 9.0);  // of the rotation about x
  CHECK(covariance[3] == 0.25);
  CHECK(fields.at_end());
}

TEST_CASE("A PoseWithCovarianceStamped has the numbers of to_ros_covariance", "[ros2]") {
  const PoseGaussian pose = uncertain_pose();
  const auto message = pose_message({kStamp_ns, "map"}, pose);
  auto fields = fields_of(message);
  check_header(fields, "map");
  check_pose(fields, pose.pose);
  std::array<double, 36> covariance{};
  fields.fill(covariance);
  CHECK(covariance == antipode::to_ros_covariance(pose));
  CHECK(fields.at_end());
}

TEST_CASE("Transforms and paths have a header of their own for every pose", "[ros2]") {
  const Pose T = car_motion();
  const std::array transforms = {RosTransform{{kStamp_ns, "map"}, "odom", T},
                                 RosTransform{{kStamp_ns, "odom"}, "camera_link", T.inverse()}};
  const auto message = transforms_message(transforms);
  auto fields = fields_of(message);
  CHECK(fields.next<std::uint32_t>() == 2);
  for (const auto& transform : transforms) {
    check_header(fields, transform.header.frame);
    CHECK(fields.text() == transform.child);
    check_pose(fields, transform.T_parent_child);
  }
  CHECK(fields.at_end());

  const std::array poses = {StampedPose{kStamp_ns, T}, StampedPose{kStamp_ns, Pose::identity()}};
  const auto path = path_message({kStamp_ns, "map"}, poses);
  auto of_path = fields_of(path);
  check_header(of_path, "map");
  CHECK(of_path.next<std::uint32_t>() == 2);
  for (const auto& pose : poses) {
    check_header(of_path, "map");
    check_pose(of_path, pose.pose);
  }
  CHECK(of_path.at_end());
  const auto empty = path_message({kStamp_ns, "map"}, {});
  CHECK(empty.size() == 4 + 8 + 8 + 4);  // CDR's header, stamp, "map" with its length and zero, count
}

TEST_CASE("A PointCloud2 declares its fields and has twelve bytes a point", "[ros2]") {
  for (const std::size_t count : {std::size_t{0}, std::size_t{3}}) {
    std::vector<Vector3<float>> points;
    for (std::size_t i = 0; i < count; ++i) points.emplace_back(1.5F + static_cast<float>(i), -2.0F, 0.25F);
    const auto message = points_message({kStamp_ns, "map"}, points);
    auto fields = fields_of(message);
    check_header(fields, "map");
    CHECK(fields.next<std::uint32_t>() == 1);
    CHECK(fields.next<std::uint32_t>() == count);
    REQUIRE(fields.next<std::uint32_t>() == 3);
    for (const auto* name : {"x", "y", "z"}) {
      CHECK(fields.text() == name);
      CHECK(fields.next<std::uint32_t>() == 4U * static_cast<std::uint32_t>(*name - 'x'));
      CHECK(fields.next<std::uint8_t>() == 7);
      CHECK(fields.next<std::uint32_t>() == 1);
    }
    CHECK(fields.next<std::uint8_t>() == 0);
    CHECK(fields.next<std::uint32_t>() == 12);
    CHECK(fields.next<std::uint32_t>() == 12 * count);
    const auto data = fields.bytes();
    REQUIRE(data.size() == 12 * count);
    CHECK(std::equal(data.begin(), data.end(), reinterpret_cast<const std::uint8_t*>(points.data())));
    CHECK(fields.next<std::uint8_t>() == 1);
    CHECK(fields.at_end());
  }
}

TEST_CASE("Diagnostics say the status in words, and how serious it is", "[ros2]") {
  FrameResult result;
  result.stamp_ns = kStamp_ns;
  result.times = {{"flow", 1.5}};
  const auto read = [&](TrackingStatus status) {
    result.status = status;
    const auto message = diagnostics_message(result, 2.25);
    auto fields = fields_of(message);
    check_header(fields, "");
    CHECK(fields.next<std::uint32_t>() == 1);
    const int level = fields.next<std::uint8_t>();
    CHECK(fields.text() == "stereo_slam: tracking");
    const std::string words = fields.text();
    CHECK(fields.text().empty());
    std::map<std::string, std::string> values;
    for (auto count = fields.next<std::uint32_t>(); count > 0; --count) {
      const std::string key = fields.text();
      values[key] = fields.text();
    }
    CHECK(fields.at_end());
    CHECK(values["status"] == to_string(status));
    CHECK(values["flow_ms"] == "1.500");
    CHECK(values["total_ms"] == "2.250");
    return std::pair(level, words);
  };
  CHECK(read(TrackingStatus::kOk) == std::pair(0, std::string("OK")));
  CHECK(read(TrackingStatus::kInitializing).first == 0);
  CHECK(read(TrackingStatus::kRelocalised).first == 0);
  CHECK(read(TrackingStatus::kLost).first == 2);
  result.weak = {.few_landmarks = true, .repetitive_scene = true};
  CHECK(read(TrackingStatus::kWeak) == std::pair(1, std::string("WEAK: few landmarks, repetitive scene")));
}

TEST_CASE("Stamps that ROS 2 does not have are refused with their value", "[ros2]") {
  for (const std::int64_t stamp_ns : {std::int64_t{-1}, std::int64_t{2'147'483'648'000'000'000}})
    CHECK_THAT(message_of([&] {
                 (void)path_message({stamp_ns, "map"}, {});
               }),
               Catch::Contains(stamp_ns < 0 ? "-1e-09 s" : "2.14748365e+09 s"));
  CHECK_NOTHROW(path_message({2'147'483'647'999'999'999, "map"}, {}));
}

TEST_CASE("A definition has every type that it needs once, each behind a line of 80 '='", "[ros2]") {
  const std::string line(80, '=');
  const auto odometry = ros2_definition("nav_msgs/msg/Odometry");
  CHECK_THAT(odometry, Catch::StartsWith("std_msgs/Header header\nstring child_frame_id\n"));
  std::size_t count = 0;
  for (std::size_t at = odometry.find(line); at != odometry.npos; at = odometry.find(line, at + 80)) {
    CHECK(odometry.substr(at + 80, 6) == "\nMSG: ");
    ++count;
  }
  CHECK(count ==
        9);  // Header, Time, PoseWithCovariance, Pose, Point, Quaternion, TwistWith..., Twist, Vector3
  CHECK_THAT(ros2_definition("std_msgs/msg/Header"),
             Catch::EndsWith(line + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"));
  CHECK_THAT(message_of([] { (void)ros2_definition("my_msgs/msg/Thing"); }),
             Catch::Contains("my_msgs/Thing"));
}
