// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "support/catch.hpp"

/// Folders, files and small recordings for the tests of stereo_slam.
namespace stereo_slam::test {

namespace fs = std::filesystem;

/// Folder that disappears with the object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "stereo_slam_test_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder at " + name);
    path_ = name;
  }
  ~TemporaryFolder() { fs::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] const fs::path& path() const { return path_; }
  fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

inline void write_text(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

inline std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

inline std::vector<std::string> split_lines(const std::string& text) {
  std::vector<std::string> lines;
  std::size_t begin = 0;
  for (auto end = text.find('\n'); end != std::string::npos; begin = end + 1, end = text.find('\n', begin)) {
    lines.push_back(text.substr(begin, end - begin));
  }
  if (begin < text.size()) lines.push_back(text.substr(begin));
  return lines;
}

/// The message of the exception that `action` throws, or "" when it throws none.
inline std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

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

/// Cuts a file to a part of its length.
inline void truncate_file(const fs::path& file, double share) {
  fs::resize_file(file, static_cast<std::uintmax_t>(static_cast<double>(fs::file_size(file)) * share));
}

}  // namespace stereo_slam::test
