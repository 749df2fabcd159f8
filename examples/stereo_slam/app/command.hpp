// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/results/pose_frame.hpp"

/// The commands of the program, one file each. Each function add_NAME adds the command NAME and its options
/// to the parser, and returns the function that runs the command once the options are parsed.
namespace stereo_slam {

/// Exit statuses.
constexpr int kDone = 0;
constexpr int kFailed = 1;         ///< the input is unusable, or the run failed
constexpr int kWrongUsage = 2;     ///< the command line is wrong
constexpr int kInterrupted = 130;  ///< a signal ended the run

/// Runs a command with its parsed options. Returns the exit status; throws std::exception when the input or
/// the run fails.
using Command = std::function<int()>;

[[nodiscard]] Command add_run(CLI::App& parent);
[[nodiscard]] Command add_compare(CLI::App& parent);
[[nodiscard]] Command add_evaluate(CLI::App& parent);
[[nodiscard]] Command add_simulate(CLI::App& parent);
[[nodiscard]] Command add_info(CLI::App& parent);

// Options that several commands have.

struct DatasetOptions {
  std::filesystem::path folder;  ///< or a video, a bag or its parts, a live camera
  std::string format = "auto";
  std::filesystem::path calibration;  ///< empty: the recording's own
  std::string left_topic;             ///< of a bag; empty: see choose_topics()
  std::string right_topic;
  std::string imu_topic;      ///< of a bag; empty: see choose_imu_topic()
  bool record_times = false;  ///< of a bag, not those in the headers
  std::optional<double> max_pair_distance_ms{};
  bool right_half_first = false;            ///< of images side by side
  std::optional<int> right_image_offset{};  ///< see offset_right_images()
  double scale = 1.0;                       ///< of the images, from 0 to 1
};

/// Scans the recording or the camera that the options name; see scan_bag() and scan_sequence().
[[nodiscard]] SequenceScan scan(const DatasetOptions& dataset);

void add_dataset_options(CLI::App& app, DatasetOptions& dataset);
CLI::Option* add_pose_frame_option(CLI::App& app, PoseFrame& frame);

// Checks of an option's text: they return what is wrong with it, or nothing.

/// Accepts decimal numbers from `least` to `most`; CLI::Range accepts NaN and hexadecimal ones, too.
[[nodiscard]] std::function<std::string(const std::string&)> number_between(double least, double most);

/// Accepts decimal whole numbers from `least` to `most`; CLI11 alone wraps negative and too large ones.
[[nodiscard]] std::function<std::string(const std::string&)> whole_number_between(std::uint64_t least,
                                                                                  std::uint64_t most);

/// The same from a negative number to a positive one.
[[nodiscard]] std::function<std::string(const std::string&)> integer_between(int least, int most);

/// Accepts the names only.
[[nodiscard]] std::function<std::string(const std::string&)> one_of(const std::vector<std::string>& names);

/// Refuses an empty name of a file or folder, and one that is an option.
[[nodiscard]] std::string require_name(const std::string& path);

/// Restricts an option to the given names, which --help lists.
void let_be_one_of(CLI::Option* option, const std::vector<std::string>& names);

/// The same for the values of an enumeration, by their names.
template <class Value>
void let_be_one_of(CLI::Option* option, const std::map<std::string, Value>& values) {
  std::vector<std::string> names;
  names.reserve(values.size());
  for (const auto& [name, value] : values) names.push_back(name);
  const auto check_and_replace = [check = one_of(names), values](std::string& name) {
    std::string error = check(name);
    if (error.empty()) name = std::to_string(static_cast<int>(values.at(name)));  // as CLI11 reads it
    return error;
  };
  option->transform(CLI::Validator(check_and_replace, ""))->type_name(CLI::detail::join(names, "|"));
}

}  // namespace stereo_slam
