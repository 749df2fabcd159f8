// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "support/catch.hpp"
#include "support/files.hpp"

/// Recordings, real and small, for the tests of stereo_slam.
namespace stereo_slam::test {

namespace fs = std::filesystem;

using antipode::test::message_of;
using antipode::test::read_text;
using antipode::test::split_lines;
using antipode::test::TemporaryFolder;
using antipode::test::write_text;

/// Folder of the real recordings; nothing, and a warning, when there is none.
inline std::optional<fs::path> data_folder() {
  const char* named = std::getenv("ANTIPODE_DATA_DIR");
  const fs::path folder = named != nullptr ? named : ANTIPODE_DEFAULT_DATA_DIR;
  if (fs::is_directory(folder)) return folder;
  WARN("skipped: real recordings are not at " << folder.string() << " (set ANTIPODE_DATA_DIR)");
  return std::nullopt;
}

/// A small recording: a textured wall 8 m ahead, passed sideways at 0.16 m a frame.
struct TinySequence {
  static constexpr int kWidth = 320;
  static constexpr int kHeight = 120;
  static constexpr double kFocal_px = 200.0;
  static constexpr double kBaseline_m = 0.4;
  static constexpr int kDisparity_px = 10;  // 200 * 0.4 / 8
  static constexpr int kShift_px = 4;       // 200 * 0.16 / 8
};

/// Smoothed random blobs, the same every time.
inline cv::Mat tiny_texture(int width) {
  cv::Mat texture(TinySequence::kHeight, width, CV_8UC1);
  cv::RNG random(7);
  random.fill(texture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(texture, texture, {0, 0}, 1.5);
  cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
  return texture;
}

inline std::string projection_line(const std::string& key, double fourth) {
  return fmt::format("{}: 200 0 160 {} 0 200 60 0 0 0 1 0\n", key, fourth);
}

inline std::string frame_name(int index) { return fmt::format("{:06}.png", index); }

/// Writes the tiny recording in KITTI layout.
inline void write_tiny_sequence(const fs::path& folder, int frames) {
  using Tiny = TinySequence;
  fs::create_directories(folder / "image_0");
  fs::create_directories(folder / "image_1");
  write_text(folder / "calib.txt",
             projection_line("P0", 0.0) + projection_line("P1", -Tiny::kFocal_px * Tiny::kBaseline_m));
  const cv::Mat texture = tiny_texture(Tiny::kWidth + Tiny::kDisparity_px + Tiny::kShift_px * frames);
  std::string times;
  std::string poses;
  for (int i = 0; i < frames; ++i) {
    const cv::Rect left(Tiny::kShift_px * i, 0, Tiny::kWidth, Tiny::kHeight);
    cv::imwrite((folder / "image_0" / frame_name(i)).string(), texture(left));
    cv::imwrite((folder / "image_1" / frame_name(i)).string(),
                texture(left + cv::Point(Tiny::kDisparity_px, 0)));
    times += fmt::format("{:.6e}\n", 0.1 * i);
    poses += fmt::format("1 0 0 {} 0 1 0 0 0 0 1 0\n", 0.16 * i);
  }
  write_text(folder / "times.txt", times);
  write_text(folder / "poses.txt", poses);
}

/// A recording of many frames that takes no room: the same two images over and over.
inline void write_long_sequence(const fs::path& folder, int frames) {
  write_tiny_sequence(folder, 2);
  fs::remove(folder / "poses.txt");  // of two frames
  std::string times;
  for (int i = 0; i < frames; ++i) {
    for (const auto* camera : {"image_0", "image_1"}) {
      if (i > 1) fs::create_hard_link(folder / camera / frame_name(i % 2), folder / camera / frame_name(i));
    }
    times += std::to_string(i) + "\n";
  }
  write_text(folder / "times.txt", times);
}

/// sensor.yaml of the tiny recording's cameras, at `x_m` in the body.
inline std::string tiny_sensor(double x_m, const std::string& model = "radial-tangential",
                               const std::string& coefficients = "0, 0, 0, 0") {
  using Tiny = TinySequence;
  return fmt::format(
      "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0, 0, {}, 0, 1, 0, 0,\n"
      "    0, 0, 1, 0, 0, 0, 0, 1]\nresolution: [{}, {}]\ncamera_model: pinhole\nintrinsics: [200, 200, 160, "
      "60]\n"
      "distortion_model: {}\ndistortion_coefficients: [{}]\n",
      x_m, Tiny::kWidth, Tiny::kHeight, model, coefficients);
}

inline std::string tiny_stamp(int index) {
  return std::to_string(1'000'000'000'000'000'000 + 100'000'000LL * index);
}

/// Writes the tiny recording in EuRoC layout.
inline void write_tiny_euroc(const fs::path& folder, int frames) {
  write_tiny_sequence(folder / "kitti", frames);
  std::string rows = "#timestamp [ns],filename\n";
  std::string truth = "#timestamp,px,py,pz,qw,qx,qy,qz\n";
  for (int i = 0; i < frames; ++i) {
    rows += fmt::format("{0},{0}.png\r\n", tiny_stamp(i));
    truth += fmt::format("{},{},0,0,1,0,0,0\n", tiny_stamp(i), 0.16 * i);
  }
  for (const int side : {0, 1}) {
    const fs::path camera = folder / "mav0" / fmt::format("cam{}", side);
    fs::create_directories(camera / "data");
    write_text(camera / "data.csv", rows);
    write_text(camera / "sensor.yaml", tiny_sensor(side * TinySequence::kBaseline_m));
    for (int i = 0; i < frames; ++i) {
      fs::rename(folder / "kitti" / fmt::format("image_{}", side) / frame_name(i),
                 camera / "data" / (tiny_stamp(i) + ".png"));
    }
  }
  fs::create_directories(folder / "mav0/state_groundtruth_estimate0");
  write_text(folder / "mav0/state_groundtruth_estimate0/data.csv", truth);
  fs::remove_all(folder / "kitti");
}

/// calibration.yaml of the tiny recording.
inline std::string tiny_calibration(const std::string& more = "frame_rate_hz: 10\n") {
  return "rectified: {fx: 200, fy: 200, cx: 160, cy: 60, baseline_m: 0.4}\n" + more;
}

/// Writes the tiny recording as two folders of images and a calibration.
inline void write_tiny_folders(const fs::path& folder, int frames) {
  write_tiny_sequence(folder, frames);
  fs::rename(folder / "image_0", folder / "left");
  fs::rename(folder / "image_1", folder / "right");
  for (const auto* name : {"calib.txt", "times.txt", "poses.txt"}) fs::remove(folder / name);
  write_text(folder / "calibration.yaml", tiny_calibration());
}

/// Replaces the first occurrence of a text in a file; it must be there.
inline void replace_in(const fs::path& file, const std::string& what, const std::string& by) {
  std::string text = read_text(file);
  const auto at = text.find(what);
  if (at == std::string::npos) throw std::logic_error(file.string() + " does not hold " + what);
  write_text(file, text.replace(at, what.size(), by));
}

/// Cuts a file to a part of its length.
inline void truncate_file(const fs::path& file, double share) {
  fs::resize_file(file, static_cast<std::uintmax_t>(static_cast<double>(fs::file_size(file)) * share));
}

}  // namespace stereo_slam::test
