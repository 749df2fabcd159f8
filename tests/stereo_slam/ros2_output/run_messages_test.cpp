// SPDX-License-Identifier: MIT
#include "stereo_slam/ros2_output/run_messages.hpp"

#include <array>

#include <antipode/distributions/covariance_conventions.hpp>

#include "stereo_slam/bags/message_fields.hpp"
#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/results/pose_frame.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr std::int64_t kStep_ns = 100'000'000;

[[nodiscard]] FrameResult frame_at(int i, const Pose& T_map_odometry) {
  FrameResult result;
  result.index = static_cast<std::size_t>(i);
  result.stamp_ns = kStep_ns * i;
  result.status = TrackingStatus::kOk;
  for (int k = 0; k < i; ++k) result.T_odometry_camera = result.T_odometry_camera * car_motion();
  result.T_world_camera = {T_map_odometry * result.T_odometry_camera,
                           1e-4 * (i + 1) * Matrix6<double>::Identity()};
  result.T_world_camera.covariance(1, 5) = result.T_world_camera.covariance(5, 1) = 5e-5;
  result.odometry = {car_motion(), 1e-6 * Matrix6<double>::Identity()};
  return result;
}

/// The messages that a run writes, read by our reader.
class Messages {
 public:
  Messages(const std::vector<FrameOutput>& frames, const std::optional<Eigen::Isometry3d>& T_body_camera,
           const std::optional<Pose>& T_camera_imu = std::nullopt) {
    std::string bytes;
    McapWriter writer([&](std::string_view more) { bytes += more; }, "tests");
    RunMessages messages(writer, T_body_camera, false, T_camera_imu);
    for (const auto& frame : frames) messages.add(frame);
    writer.end();
    write_text(folder_ / "run.mcap", bytes);
    file_ = open_mcap_file(folder_ / "run.mcap");
  }

  [[nodiscard]] std::size_t count(const std::string& topic) { return file_->places(topic).size(); }

  /// Message `i` of the topic; valid until the next call.
  [[nodiscard]] MessageFields fields(const std::string& topic, std::size_t i) {
    return {file_->read(file_->places(topic).at(i)), Serialization::kCdr};
  }

 private:
  TemporaryFolder folder_;
  std::unique_ptr<MessageFile> file_;
};

[[nodiscard]] Pose next_pose(MessageFields& fields) {
  std::array<double, 7> n{};
  fields.fill(n);
  return Pose::from_matrix(Eigen::Quaterniond(n[6], n[3], n[4], n[5]).toRotationMatrix(),
                           Vector3<double>(n[0], n[1], n[2]));
}

[[nodiscard]] Pose next_transform(MessageFields& fields, const std::string& parent,
                                  const std::string& child) {
  (void)fields.stamp_ns();
  CHECK(fields.text() == parent);
  CHECK(fields.text() == child);
  return next_pose(fields);
}

struct Odometry {
  std::string child;
  Pose pose = Pose::identity();
  std::array<double, 36> covariance{};
  std::array<double, 6> twist{};
  std::array<double, 36> twist_covariance{};
};

[[nodiscard]] Odometry odometry_in(Messages& messages, std::size_t i) {
  auto fields = messages.fields("/stereo_slam/odometry", i);
  fields.skip_header();
  Odometry odometry;
  odometry.child = fields.text();
  odometry.pose = next_pose(fields);
  fields.fill(odometry.covariance);
  fields.fill(odometry.twist);
  fields.fill(odometry.twist_covariance);
  return odometry;
}

[[nodiscard]] double largest_difference(const std::array<double, 36>& a, const std::array<double, 36>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

}  // namespace

TEST_CASE("A camera without body drives forward along x, and z is up", "[ros2]") {
  Messages messages({{frame_at(0, Pose::identity())}, {frame_at(1, Pose::identity())}}, std::nullopt);
  const auto odometry = odometry_in(messages, 1);
  CHECK(odometry.child == "camera_link");
  const Vector3<double> t = car_motion().translation();  // of the camera: x right, y down, z forward
  CHECK((odometry.pose.translation() - Vector3<double>(t.z(), -t.x(), -t.y())).norm() < 1e-12);
  CHECK(odometry.twist[0] == Approx((car_motion().log() / 0.1)[5]));
  CHECK(odometry.twist_covariance[0] == Approx(1e-6 / 0.01));

  auto fields = messages.fields("/tf_static", 0);
  CHECK(fields.next<std::uint32_t>() == 1);
  const Pose T_link_optical = next_transform(fields, "camera_link", "camera_optical_frame");
  CHECK((T_link_optical * Vector3<double>(0.0, 0.0, 1.0) - Vector3<double>(1.0, 0.0, 0.0)).norm() < 1e-12);
  CHECK((T_link_optical * Vector3<double>(0.0, 1.0, 0.0) - Vector3<double>(0.0, 0.0, -1.0)).norm() < 1e-12);
}

TEST_CASE("The covariance of an Odometry is to_ros_covariance of that in covariances.csv", "[ros2]") {
  for (const bool has_body : {false, true}) {
    Eigen::Isometry3d T_body_camera = Eigen::Isometry3d::Identity();
    T_body_camera.linear() = Pose::exp(Vector6<double>::Constant(0.4)).rotation_matrix();
    if (has_body) T_body_camera.translation() << 1.0, -0.2, 0.5;
    std::vector<FrameOutput> frames;
    frames.reserve(6);
    for (int i = 0; i < 6; ++i) frames.push_back({frame_at(i, Pose::identity())});
    Messages messages(frames, T_body_camera);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const auto odometry = odometry_in(messages, i);
      CHECK(odometry.child == "base_link");
      // With --pose-frame body the file has the covariance of the body, otherwise that of the camera: at the
      // same place, it has the same covariance along the axes of the parent.
      const FrameResult body = in_body_frame(frames[i].result, T_body_camera);
      const auto of_body =
          antipode::to_ros_covariance(PoseGaussian{odometry.pose, body.T_world_camera.covariance});
      CHECK(largest_difference(odometry.covariance, of_body) < 1e-12);
      if (has_body) continue;
      const Pose T_odom_camera =
          odometry.pose * Pose::from_matrix(T_body_camera.linear(), T_body_camera.translation());
      const auto of_camera = antipode::to_ros_covariance(
          PoseGaussian{T_odom_camera, frames[i].result.T_world_camera.covariance});
      CHECK(largest_difference(odometry.covariance, of_camera) < 1e-12);
    }
  }
}

TEST_CASE("The transforms map to odom to base lead to the pose in the map", "[ros2]") {
  Vector6<double> xi;
  xi << 0.1, -0.2, 0.05, 1.0, 2.0, -0.5;
  FrameResult moved = frame_at(2, Pose::exp(xi));
  moved.loop_corrected = true;
  Messages messages({{frame_at(0, Pose::identity())}, {frame_at(1, Pose::identity())}, {moved}},
                    std::nullopt);
  REQUIRE(messages.count("/tf") == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    auto fields = messages.fields("/tf", i);
    CHECK(fields.next<std::uint32_t>() == 2);
    const Pose T_map_odom = next_transform(fields, "map", "odom");
    const Pose T_odom_base = next_transform(fields, "odom", "camera_link");
    CHECK(T_map_odom.is_approx(Pose::identity(), 1e-12) == (i < 2));
    auto pose_fields = messages.fields("/stereo_slam/pose", i);
    pose_fields.skip_header();
    CHECK((T_map_odom * T_odom_base).is_approx(next_pose(pose_fields), 1e-12));
    CHECK(T_odom_base.is_approx(odometry_in(messages, i).pose, 1e-12));
  }
}

TEST_CASE("A velocity that was not measured is that of the prediction, and nothing is known of it",
          "[ros2]") {
  FrameResult lost = frame_at(1, Pose::identity());
  lost.status = TrackingStatus::kLost;
  FrameResult unmeasured = frame_at(2, Pose::identity());
  unmeasured.odometry = {};
  Messages messages({{frame_at(0, Pose::identity())}, {lost}, {unmeasured}}, std::nullopt);
  for (const std::size_t i : {1, 2}) {
    const auto odometry = odometry_in(messages, i);
    CHECK(odometry.twist[0] == Approx((car_motion().log() / 0.1)[5]));
    CHECK(odometry.twist_covariance[0] == Approx(100.0 * 100.0 / 0.01));
  }
  CHECK(odometry_in(messages, 0).twist_covariance[0] == 100.0 * 100.0);  // the first frame has none before it
}

TEST_CASE("Frames with the same stamp, and landmarks and paths that are there, are written", "[ros2]") {
  FrameOutput frame{frame_at(1, Pose::identity())};
  frame.new_landmarks_world = {{1.0F, 2.0F, 3.0F}};
  frame.path = {{0, Pose::identity()}, {kStep_ns, car_motion()}};
  Messages messages({{frame_at(1, Pose::identity())}, frame}, std::nullopt);
  CHECK(messages.count("/stereo_slam/odometry") == 2);
  CHECK(messages.count("/stereo_slam/landmarks") == 1);
  CHECK(messages.count("/stereo_slam/path") == 1);
  CHECK(odometry_in(messages, 1).twist == std::array<double, 6>{});
}

TEST_CASE("With an IMU the velocity of the base is that of the filter, carried from the IMU to the base",
          "[ros2][imu]") {
  Vector6<double> xi;
  xi << 0.3, -0.2, 0.5, 0.4, -0.1, 0.2;
  const Pose T_camera_imu = Pose::exp(xi);
  const Eigen::Isometry3d T_body_camera = Eigen::Isometry3d::Identity();
  FrameOutput frame{frame_at(1, Pose::identity())};
  InertialEstimate& imu = frame.result.inertial;
  imu.phase = InertialPhase::kRunning;
  imu.gravity << 1.0, 2.0, -9.5;
  imu.biases << 0.01, 0.02, 0.03, 0.1, 0.2, 0.3;
  imu.covariance.diagonal().setConstant(0.04);
  const Vector3<double> w = (car_motion().log() / 0.1).head<3>(), v_camera(0.5, -0.2, 8.0);
  // Rigid: the IMU moves as the camera does, and turns about it.
  imu.velocity =
      T_camera_imu.rotation_matrix().transpose() * (v_camera + w.cross(T_camera_imu.translation()));
  Messages messages({{frame_at(0, Pose::identity())}, frame}, T_body_camera, T_camera_imu);
  const auto [child, pose, covariance, twist, twist_covariance] = odometry_in(messages, 1);
  for (int i = 0; i < 3; ++i) {
    CAPTURE(i);
    CHECK(twist[static_cast<std::size_t>(i)] == Approx(v_camera[i]));
    CHECK(twist[static_cast<std::size_t>(i + 3)] == Approx(w[i]));
    // The rate is known to 1e-6 / .01; at the IMU's distance it adds that times its square, at most.
    const double variance = twist_covariance[static_cast<std::size_t>(7 * i)];
    CHECK(variance > 0.04);
    CHECK(variance < 0.04 + 1e-4 * T_camera_imu.translation().squaredNorm() + 1e-12);
  }

  const auto read = [&](const std::string& topic, int begin) -> Vector3<double> {
    auto fields = messages.fields("/stereo_slam/imu/" + topic, 0);
    (void)fields.stamp_ns();
    CHECK(fields.text() == "imu_link");
    std::array<double, 6> numbers{};
    std::array<double, 36> P{};
    fields.fill(numbers);
    fields.fill(P);
    CHECK(P[static_cast<std::size_t>(7 * begin)] == 0.04);
    CHECK(P[static_cast<std::size_t>(7 * (3 - begin))] == 0.0);
    return Vector3<double>(numbers.data() + begin);
  };
  CHECK(messages.count("/stereo_slam/imu/gravity") == 1);  // not in the frame before it ran
  CHECK(read("gravity", 0) == imu.gravity);
  CHECK(read("accelerometer_bias", 0) == imu.biases.tail<3>());
  CHECK(read("gyroscope_bias", 3) == imu.biases.head<3>());
  auto fields = messages.fields("/tf_static", 0);
  CHECK(fields.next<std::uint32_t>() == 2);
  (void)next_transform(fields, "base_link", "camera_optical_frame");
  CHECK(next_transform(fields, "base_link", "imu_link").is_approx(T_camera_imu, 1e-12));
}
