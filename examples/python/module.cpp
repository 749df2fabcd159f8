// SPDX-License-Identifier: MIT
// The module stereo_slam: image pairs in, poses with covariances out, as numpy arrays.
#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <stereo_slam/stereo_slam.hpp>
#include <string>
#include <variant>
#include <vector>

#include "images.hpp"

namespace py = pybind11;
using namespace stereo_slam;

namespace {

/// Eigen stores matrices column by column, numpy row by row.
template <int Size>
using RowMajor = Eigen::Matrix<double, Size, Size, Eigen::RowMajor>;

[[nodiscard]] RowMajor<4> matrix_of(const Pose& pose) { return pose.isometry().matrix(); }

[[nodiscard]] std::vector<std::string> names_of(const WeakReasons& weak) {
  std::vector<std::string> names;
  for (const auto& reason : kWeakReasons) {
    if (weak.*reason.flag) names.emplace_back(reason.name);
  }
  return names;
}

/// An array of `count` elements of this shape, into which `fill(i)` is copied.
template <class Fill>
[[nodiscard]] py::array_t<double> stacked(std::size_t count, std::vector<py::ssize_t> shape,
                                          const Fill& fill) {
  shape.insert(shape.begin(), static_cast<py::ssize_t>(count));
  py::array_t<double> array(shape);
  double* to = array.mutable_data();
  for (std::size_t i = 0; i < count; ++i) {
    const auto element = fill(i);
    to = std::copy_n(element.data(), element.size(), to);
  }
  return array;
}

/// The poses of frames as arrays with a row a frame.
[[nodiscard]] py::dict as_dict(const std::vector<FramePose>& frames) {
  std::vector<std::int64_t> stamps_ns;
  std::vector<std::string> statuses;
  for (const auto& frame : frames) {
    stamps_ns.push_back(frame.stamp_ns);
    statuses.emplace_back(to_string(frame.status));
  }
  py::dict dict;
  dict["stamp_ns"] = py::array_t<std::int64_t>(static_cast<py::ssize_t>(frames.size()), stamps_ns.data());
  dict["status"] = statuses;
  dict["T_world_camera"] =
      stacked(frames.size(), {4, 4}, [&](std::size_t i) { return matrix_of(frames[i].T_world_camera.pose); });
  dict["covariance"] = stacked(
      frames.size(), {6, 6}, [&](std::size_t i) { return RowMajor<6>(frames[i].T_world_camera.covariance); });
  return dict;
}

/// A calibration file, or the rectified camera (fx, fy, cx, cy, baseline_m).
using Cameras = std::variant<std::filesystem::path, std::array<double, 5>>;

[[nodiscard]] StereoSlam make_slam(const Cameras& cameras, const SlamOptions& options) {
  if (const auto* file = std::get_if<std::filesystem::path>(&cameras)) return StereoSlam(*file, options);
  const auto& [fx, fy, cx, cy, baseline_m] = std::get<std::array<double, 5>>(cameras);
  return StereoSlam(StereoCamera{.fx = fx, .fy = fy, .cx = cx, .cy = cy, .baseline_m = baseline_m}, options);
}

[[nodiscard]] FrameResult process(StereoSlam& slam, const py::object& left, const py::object& right,
                                  std::int64_t stamp_ns) {
  const cv::Mat left_image = image_in(left);
  const cv::Mat right_image = image_in(right);
  const py::gil_scoped_release other_threads_run;
  return slam.process(left_image, right_image, stamp_ns);
}

[[nodiscard]] py::array_t<double> map_points(const StereoSlam& slam) {
  const auto points = slam.map_points();
  return stacked(points.size(), {3}, [&](std::size_t i) { return points[i].position_world; });
}

void add_frame(py::module_& module) {
  py::class_<FrameResult>(module, "Frame", "The result of one image pair.")
      .def_readonly("index", &FrameResult::index, "number of pairs processed before")
      .def_readonly("stamp_ns", &FrameResult::stamp_ns)
      .def_property_readonly(
          "status", [](const FrameResult& frame) { return to_string(frame.status); },
          "INITIALIZING, OK, WEAK, LOST or RELOCALISED")
      .def_property_readonly(
          "reasons", [](const FrameResult& frame) { return names_of(frame.weak); }, "why the pose is weak")
      .def_property_readonly(
          "T_world_camera", [](const FrameResult& frame) { return matrix_of(frame.T_world_camera.pose); },
          "4x4: maps coordinates of the rectified left camera to the world")
      .def_property_readonly(
          "covariance", [](const FrameResult& frame) { return RowMajor<6>(frame.T_world_camera.covariance); },
          "6x6, of xi in T exp(xi): rotation (rad), then translation (m)")
      .def_property_readonly(
          "T_odometry_camera", [](const FrameResult& frame) { return matrix_of(frame.T_odometry_camera); },
          "4x4, without loop corrections: it drifts and never jumps")
      .def_readonly("loop_corrected", &FrameResult::loop_corrected,
                    "a loop moved earlier poses before this frame")
      .def_readonly("is_keyframe", &FrameResult::is_keyframe)
      .def_readonly("landmarks", &FrameResult::landmarks)
      .def_readonly("matches", &FrameResult::matches);
}

void add_slam(py::module_& module) {
  py::class_<StereoSlam>(module, "StereoSlam",
                         "Stereo visual SLAM. `cameras` is the path of a calibration, or (fx, fy, cx, cy, "
                         "baseline_m) of rectified cameras in pixels and metres.")
      .def(py::init([](const Cameras& cameras, const std::string& preset,
                       const std::map<std::string, std::string>& settings,
                       const std::optional<std::filesystem::path>& load_map, bool extend_map) {
             SlamOptions options;
             options.preset = preset;
             options.settings = settings;
             options.load_map = load_map;
             options.extend_map = extend_map;
             return make_slam(cameras, options);
           }),
           py::arg("cameras"), py::kw_only(), py::arg("preset") = "default",
           py::arg("settings") = std::map<std::string, std::string>{}, py::arg("load_map") = py::none(),
           py::arg("extend_map") = false)
      .def("process", &process, py::arg("left"), py::arg("right"), py::arg("stamp_ns"),
           "Tracks a pair: arrays of uint8 or uint16, grey, BGR or BGRA, which are not copied before. "
           "`right` may "
           "be None. Other Python threads run meanwhile.")
      .def("finish", &StereoSlam::finish, py::call_guard<py::gil_scoped_release>(),
           "Waits for loops that are still being closed. Call it after the last pair.")
      .def(
          "trajectory", [](const StereoSlam& slam) { return as_dict(slam.trajectory()); },
          "The poses of all pairs as known now: stamp_ns, status, T_world_camera (n x 4 x 4), covariance (n "
          "x 6 x 6)")
      .def(
          "keyframes", [](const StereoSlam& slam) { return as_dict(slam.keyframes()); },
          "The same of the keyframes.")
      .def("map_points", &map_points, "The landmarks in world coordinates, n x 3, metres")
      .def("save_map", &StereoSlam::save_map, py::arg("file"));
}

}  // namespace

PYBIND11_MODULE(stereo_slam, module) {
  module.doc() = "Stereo visual SLAM with a covariance for every pose.";
  add_frame(module);
  add_slam(module);
}
