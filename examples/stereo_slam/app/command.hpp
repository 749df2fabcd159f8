// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/results/pose_frame.hpp"

/// The commands of the program, one file each. A function below adds the command with its options to the
/// parser and returns what it does once they are parsed.
namespace stereo_slam {

/// Exit statuses.
constexpr int kDone = 0;
constexpr int kFailed = 1;  ///< the input or the run
constexpr int kWrongUsage = 2;
constexpr int kInterrupted = 130;

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
  std::filesystem::path folder;  ///< or a video, a bag, a live camera
  std::string format = "auto";
  std::filesystem::path calibration;  ///< empty: that of the recording
  std::string left_topic;             ///< of a bag; empty: found by its name
  std::string right_topic;
};

/// The recording or the camera that the options name.
[[nodiscard]] SequenceScan scan(const DatasetOptions& dataset);

void add_dataset_options(CLI::App& app, DatasetOptions& dataset);
void add_pose_frame_option(CLI::App& app, PoseFrame& frame);

/// Lets an option have one of some values, which --help lists by their names.
template <class Value>
void let_be_one_of(CLI::Option* option, const std::map<std::string, Value>& values) {
  std::string names;
  for (const auto& [name, value] : values) names += (names.empty() ? "" : "|") + name;
  option->transform(CLI::CheckedTransformer(values).description(""))->type_name(names);
}

/// The same for an option that keeps the name.
void let_be_one_of(CLI::Option* option, const std::vector<std::string>& names);

// Checks of an option's text: they return what is wrong with it, or nothing.

/// Accepts decimal numbers from `least` to `most`; CLI::Range accepts NaN and hexadecimal ones, too.
[[nodiscard]] std::function<std::string(const std::string&)> number_between(double least, double most);

/// Accepts decimal whole numbers; CLI11 wraps what is negative or too large.
[[nodiscard]] std::function<std::string(const std::string&)> whole_number_between(std::uint64_t least,
                                                                                  std::uint64_t most);

/// Accepts the name of a file or folder unless it is empty.
[[nodiscard]] std::string require_name(const std::string& path);

}  // namespace stereo_slam
