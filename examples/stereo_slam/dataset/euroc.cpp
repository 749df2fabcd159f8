// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/euroc.hpp"

#include <string>

#include <fmt/format.h>

#include "stereo_slam/dataset/image_file.hpp"
#include "stereo_slam/dataset/rig_file.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

constexpr auto kError = Problem::Severity::kError;
constexpr auto kWarning = Problem::Severity::kWarning;
/// Stamps of cameras with a common trigger differ by rounding and message delay; frames are at least 10 ms
/// apart.
constexpr std::int64_t kMaxPairDifference_ns = 1'000'000;

/// A row of data.csv.
struct Row {
  int line = 0;
  std::int64_t stamp_ns = 0;
  fs::path image;
};

std::vector<Row> read_rows(const fs::path& camera) {
  const fs::path csv = camera / "data.csv";
  if (!fs::exists(csv)) {
    throw std::runtime_error(
        fmt::format("{}: missing; it lists the images as 'stamp in ns, file name'", csv.string()));
  }
  std::vector<Row> rows;
  for (const auto& line : read_text_lines(csv)) {
    const auto fail = [&](const std::string& what) {
      throw std::runtime_error(at_line(csv, line.number, what));
    };
    const auto fields = split_fields(line.text);
    const std::int64_t stamp_ns = parse_nanoseconds(fields[0]).value_or(-1);
    if (stamp_ns < 0) fail(fmt::format("'{}' is not a stamp in whole nanoseconds", fields[0]));
    if (fields.size() != 2) {
      fail(fmt::format("'{}' is not 'stamp in ns, file name'; the file is damaged or truncated", line.text));
    }
    if (!rows.empty() && stamp_ns == rows.back().stamp_ns)
      fail(fmt::format("stamp {} occurs twice; delete one of the rows", fields[0]));
    if (!rows.empty() && stamp_ns < rows.back().stamp_ns)
      fail(fmt::format("stamp {} is earlier than the one before; sort the rows", fields[0]));
    rows.push_back({line.number, stamp_ns, camera / "data" / fields[1]});
  }
  if (rows.empty()) throw std::runtime_error(fmt::format("{}: lists no images", csv.string()));
  return rows;
}

/// Counts the rows that have no partner in the other camera.
struct Unpaired {
  std::size_t count = 0;
  int first_line = 0;
  void add(const Row& row) {
    if (count++ == 0) first_line = row.line;
  }
  void report(const fs::path& camera, std::size_t rows, const char* other, SequenceScan& scan) const {
    if (count == 0) return;
    scan.problems.push_back(
        {kWarning,
         at_line(camera / "data.csv", first_line,
                 fmt::format("{} of {} rows, this one first, have no partner in {} within 1 ms; they are "
                             "left out",
                             count, rows, other))});
  }
};

/// Pairs rows by stamp in one pass, as both lists increase.
void pair_rows(const fs::path& mav, const std::vector<Row>& left, const std::vector<Row>& right,
               SequenceScan& scan) {
  Unpaired left_only;
  Unpaired right_only;
  std::size_t missing = 0;
  std::string first_missing;
  const auto present = [&](const Row& row, const char* camera) {
    if (fs::is_regular_file(row.image)) return true;
    if (missing++ == 0) {
      first_missing =
          at_line(mav / camera / "data.csv", row.line,
                  fmt::format("{} is missing; restore the image or delete the row", row.image.string()));
    }
    return false;
  };
  for (std::size_t i = 0, j = 0; i < left.size() || j < right.size();) {
    const bool left_ends = i == left.size();
    const bool right_ends = j == right.size();
    if (right_ends || (!left_ends && left[i].stamp_ns < right[j].stamp_ns - kMaxPairDifference_ns)) {
      left_only.add(left[i++]);
    } else if (left_ends || right[j].stamp_ns < left[i].stamp_ns - kMaxPairDifference_ns) {
      right_only.add(right[j++]);
    } else {
      const bool both = present(left[i], "cam0") && present(right[j], "cam1");
      if (both) scan.sequence.frames.push_back({left[i].stamp_ns, left[i].image, right[j].image});
      ++i;
      ++j;
    }
  }
  if (missing > 0) {
    const std::string more = missing > 1 ? fmt::format(" (and {} more like it)", missing - 1) : "";
    scan.problems.push_back({kError, first_missing + more});
    return;
  }
  left_only.report(mav / "cam0", left.size(), "cam1", scan);
  right_only.report(mav / "cam1", right.size(), "cam0", scan);
  if (scan.sequence.frames.empty()) {
    throw std::runtime_error(fmt::format(
        "{}: no images of cam0 and cam1 have the same stamp within 1 ms; the cameras must be synchronised",
        mav.string()));
  }
  if (scan.sequence.frames.size() < 2)
    throw std::runtime_error(
        fmt::format("{}: contains a single frame; a sequence needs at least two", mav.string()));
}

StereoRig read_rig(const fs::path& mav) {
  if (!fs::exists(mav / "cam0/sensor.yaml") && !fs::exists(mav / "cam1/sensor.yaml")) {
    const fs::path parent = fs::canonical(mav).parent_path();
    for (const auto& file : {mav / "camchain.yaml", parent / "camchain.yaml", parent / "dso/camchain.yaml"}) {
      if (fs::exists(file)) return read_camchain(file);
    }
  }
  return read_sensor_files(mav / "cam0/sensor.yaml", mav / "cam1/sensor.yaml");
}

/// The ground truth at the times of the frames, as poses of the camera.
void read_ground_truth(const fs::path& mav, StereoSequence& sequence) {
  fs::path file = mav / "state_groundtruth_estimate0/data.csv";
  if (!fs::exists(file)) file = mav / "mocap0/data.csv";
  if (!fs::exists(file)) return;
  if (!sequence.T_body_camera) {
    throw std::runtime_error(
        fmt::format("{}: contains poses of the body, but the calibration is without T_BS; the ground "
                    "truth is left out",
                    file.string()));
  }
  constexpr std::int64_t kMargin_ns = 50'000'000;
  const Trajectory truth = read_trajectory(file, TrajectoryFormat::kEuroc);
  for (std::size_t i = 0; i < truth.poses.size(); ++i) {
    const auto stamp_ns = truth.stamps_ns[i];
    if (stamp_ns < sequence.frames.front().stamp_ns - kMargin_ns) continue;
    if (stamp_ns > sequence.frames.back().stamp_ns + kMargin_ns) break;
    sequence.ground_truth.push_back(truth.poses[i] * *sequence.T_body_camera);
    sequence.ground_truth_ns.push_back(stamp_ns);
  }
  if (sequence.ground_truth.empty())
    throw std::runtime_error(fmt::format("{}: contains no pose at the time of the images", file.string()));
}

}  // namespace

bool looks_like_euroc(const fs::path& folder) {
  return fs::is_directory(folder / "mav0") || fs::exists(folder / "cam0/data.csv") ||
         fs::exists(folder / "cam1/data.csv");
}

SequenceScan scan_euroc(const fs::path& folder) {
  const fs::path mav = fs::is_directory(folder / "mav0") ? folder / "mav0" : folder;
  SequenceScan scan;
  StereoSequence& sequence = scan.sequence;
  auto& problems = scan.problems;
  sequence.folder = folder;
  sequence.format = "euroc";
  sequence.left_name = "cam0";
  sequence.right_name = "cam1";
  if (!fs::is_directory(mav / "cam0") || !fs::is_directory(mav / "cam1")) {
    problems.push_back(
        {kError, fmt::format("{}: has no cam0 and cam1; expected {}", mav.string(), kEurocLayout)});
    return scan;
  }
  std::vector<Row> left;
  std::vector<Row> right;
  attempt(problems, kError, [&] {
    const StereoRig rig = read_rig(mav);
    try {
      set_rig(sequence, rig);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: {}", (mav / "cam1").string(), error.what()));
    }
  });
  attempt(problems, kError, [&] { left = read_rows(mav / "cam0"); });
  attempt(problems, kError, [&] { right = read_rows(mav / "cam1"); });
  if (left.empty() || right.empty()) return scan;
  attempt(problems, kError, [&] { pair_rows(mav, left, right, scan); });
  if (sequence.frames.empty() || !sequence.rectifier) return scan;
  attempt(problems, kError, [&] {
    const auto& file = sequence.frames.front().left;
    const ImageHeader header = check_image(file);
    if (header.width_px == sequence.camera.width_px && header.height_px == sequence.camera.height_px) return;
    throw std::runtime_error(
        fmt::format("{}: is {}x{} pixels, but the resolution of the calibration is {}x{}; use the "
                    "calibration of these images",
                    file.string(), header.width_px, header.height_px, sequence.camera.width_px,
                    sequence.camera.height_px));
  });
  attempt(problems, kWarning, [&] { read_ground_truth(mav, sequence); });
  return scan;
}

}  // namespace stereo_slam
