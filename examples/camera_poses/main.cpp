// SPDX-License-Identifier: MIT
// Prints the pose of a stereo camera and how uncertain it is, for every frame:
//
//   camera_poses calibration.yaml 0 2                                 two cameras, /dev/video0 and
//   /dev/video2 camera_poses calibration.yaml left.mp4 right.mp4                  or videos, URLs,
//   left/%06d.png ...
#include <chrono>
#include <cstdio>
#include <exception>
#include <stereo_slam/stereo_slam.hpp>
#include <string>

#include <opencv2/videoio.hpp>

namespace {

cv::VideoCapture open(const std::string& source) {
  const bool is_number = source.find_first_not_of("0123456789") == std::string::npos;
  return is_number ? cv::VideoCapture(std::stoi(source)) : cv::VideoCapture(source);
}

void print_poses(const std::string& calibration, cv::VideoCapture left, cv::VideoCapture right) {
  stereo_slam::StereoSlam slam(calibration);
  cv::Mat left_image, right_image;
  while (left.grab() && right.grab()) {  // both at once, before either is decoded
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    if (!left.retrieve(left_image) || !right.retrieve(right_image)) break;
    const auto result = slam.process(left_image, right_image, std::chrono::nanoseconds(now).count());

    const auto& [T_world_camera, covariance] = result.T_world_camera;
    const Eigen::Vector3d p_m = T_world_camera.translation();
    const double sigma_deg = 57.2958 * std::sqrt(covariance.topLeftCorner<3, 3>().trace() / 3.0);
    const double sigma_m = std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3.0);
    std::printf("%6zu %-12s  %8.3f %8.3f %8.3f m +- %.3f m, %.3f deg\n", result.index,
                to_string(result.status), p_m.x(), p_m.y(), p_m.z(), sigma_m, sigma_deg);
  }
  slam.finish();
  std::printf("%zu landmarks, %zu loops\n", slam.map_points().size(), slam.loops().size());
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 4) return std::fprintf(stderr, "usage: camera_poses CALIBRATION LEFT RIGHT\n"), 2;
  print_poses(argv[1], open(argv[2]), open(argv[3]));
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "camera_poses: %s\n", error.what());
  return 1;
}
