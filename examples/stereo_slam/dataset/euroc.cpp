// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/euroc.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "stereo_slam/calibration/rig_file.hpp"
#include "stereo_slam/dataset/stamp_pairs.hpp"
#include "stereo_slam/images/image_file.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/table_row.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/stamps/stamp_units.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

constexpr auto kError = Problem::Severity::kError;
constexpr auto kWarning = Problem::Severity::kWarning;

/// A row of data.csv.
struct Row {
  int line = 0;
  std::int64_t stamp_ns = 0;
  fs::path image;
};

/// Fields divided by semicolons, else by commas, else by blanks.
std::vector<std::string_view> csv_fields(std::string_view line) {
  auto fields = split_row(line, separator_of(line));
  if (fields.back().empty()) fields.pop_back();
  return fields;
}

/// The column of the file names: the first one after the stamp that is called like an image.
std::size_t name_column(const std::vector<std::string_view>& fields) {
  const auto name =
      std::find_if(fields.begin() + 1, fields.end(), [](const auto& field) { return has_image_name(field); });
  return name == fields.end() ? 1 : static_cast<std::size_t>(name - fields.begin());
}

/// The folder that the names of data.csv are relative to: usually `data`. Names with a path may begin at any
/// folder above, or be those of another computer, of which the last part counts.
fs::path image_at(const fs::path& camera, std::string name) {
  std::ranges::replace(name, '\\', '/');
  fs::path usual = camera / "data" / name;
  std::error_code unusable;  // a name that is too long, say
  if (!fs::path(name).has_parent_path() || fs::is_regular_file(usual, unusable)) return usual;
  const fs::path mav = camera.parent_path();
  for (const auto& base : {camera, mav, mav.parent_path()}) {
    if (fs::is_regular_file(base / name, unusable)) return base / name;
  }
  return camera / "data" / fs::path(name).filename();
}

/// The stamps of the rows, whose texts are whole numbers or decimal ones: in the unit that they show, or else
/// nanoseconds.
std::vector<std::int64_t> stamps_of_rows(const fs::path& csv, const std::vector<WrittenNumber>& texts) {
  Stamps stamps;
  try {
    stamps = stamps_of(with_decimals(texts));
  } catch (const std::invalid_argument& error) {
    fail(csv, error.what());
  }
  if (!stamps.ns.empty()) return std::move(stamps.ns);
  if (!texts.front().fraction.empty())
    fail(csv, "its stamps have no certain unit: {}; write them in nanoseconds", stamps.doubt);
  for (const auto& text : texts) stamps.ns.push_back(parse_nanoseconds(text.whole).value_or(kLatestStamp_ns));
  return std::move(stamps.ns);
}

/// A stamp of digits, with a point or a comma between them if `decimal`; nothing for another text.
std::optional<WrittenNumber> stamp_text(std::string_view field, bool decimal) {
  constexpr std::string_view kDigits = "0123456789";
  const std::size_t point = std::min(field.find_first_of(".,"), field.size());
  WrittenNumber number{.whole = std::string(field.substr(0, point)),
                       .fraction = std::string(field.substr(std::min(point + 1, field.size())))};
  const bool digits = number.whole.find_first_not_of(kDigits) == std::string::npos &&
                      number.fraction.find_first_not_of(kDigits) == std::string::npos;
  const bool whole = parse_nanoseconds(number.whole).has_value();
  if (!digits || !whole || decimal == number.fraction.empty()) return std::nullopt;
  return number;
}

/// Whether a line names the columns, without the usual '#'.
bool is_heading(const std::string& line) {
  return line.substr(0, line.find(separator_of(line))).find_first_of("0123456789") == std::string::npos;
}

void require_increasing(const fs::path& csv, const std::vector<Row>& rows) {
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const auto fail_here = [&](std::string_view what) {
      fail_at(csv, rows[i].line, "stamp {} {}", rows[i].stamp_ns, what);
    };
    if (rows[i].stamp_ns == rows[i - 1].stamp_ns) fail_here("occurs twice; delete one of the rows");
    if (rows[i].stamp_ns < rows[i - 1].stamp_ns) fail_here("is earlier than the one before; sort the rows");
  }
}

std::vector<Row> read_rows(const fs::path& camera) {
  const fs::path csv = camera / "data.csv";
  if (!fs::exists(csv)) fail(csv, "missing; it lists the images as 'stamp in ns, file name'");
  std::vector<Row> rows;
  std::vector<WrittenNumber> stamps;
  std::size_t columns = 0;
  std::size_t name = 0;
  auto lines = read_text_lines(csv);
  if (!lines.empty() && is_heading(lines.front().text)) lines.erase(lines.begin());
  for (const auto& line : lines) {
    const auto fail_here = [&](const std::string& what) { fail_at(csv, line.number, what); };
    const auto fields = csv_fields(line.text);
    const bool decimal = fields[0].find_first_of(".,") != std::string::npos;
    const auto stamp = stamp_text(fields[0], rows.empty() ? decimal : !stamps.front().fraction.empty());
    if (!stamp)
      fail_here(fmt::format("'{}' is not a stamp in nanoseconds, or in the unit of the first", fields[0]));
    if (rows.empty()) columns = fields.size();
    if (columns < 2 || fields.size() != columns) {
      fail_here(
          fmt::format("'{}' is not 'stamp in ns, file name'; the file is damaged or truncated", line.text));
    }
    if (rows.empty()) name = name_column(fields);
    rows.push_back({line.number, 0, image_at(camera, std::string(fields[name]))});
    stamps.push_back(*stamp);
  }
  if (rows.empty()) fail(csv, "lists no images");
  const auto stamps_ns = stamps_of_rows(csv, stamps);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].stamp_ns = stamps_ns[i];
  require_increasing(csv, rows);
  return rows;
}

/// Warns of rows that have no partner in the other camera.
void report_alone(const fs::path& camera, const std::vector<Row>& rows, const std::vector<std::size_t>& alone,
                  const StampPairs& pairs, SequenceScan& scan) {
  if (alone.empty()) return;
  const char* other = camera.filename() == "cam0" ? "cam1" : "cam0";
  scan.problems.push_back(
      {kWarning,
       at_line(camera / "data.csv", rows[alone.front()].line,
               fmt::format(
                   "{} of {} rows, this one first, have no partner in {} within {:.4g} ms; they are left out",
                   alone.size(), rows.size(), other, pairs.most_apart_ms))});
}

CameraStamps stamps_of_camera(const char* name, const std::vector<Row>& rows) {
  CameraStamps camera{.name = name, .stamps_ns = {}};
  for (const auto& row : rows) camera.stamps_ns.push_back(row.stamp_ns);
  return camera;
}

void pair_rows(const fs::path& mav, const std::vector<Row>& left, const std::vector<Row>& right,
               const PairingOptions& options, SequenceScan& scan) {
  if (left.size() < 2 || right.size() < 2) {
    fail(mav / (left.size() < 2 ? "cam0" : "cam1"), "contains a single frame; a sequence needs at least two");
  }
  const StampPairs pairs =
      paired_by_stamps(stamps_of_camera("cam0", left), stamps_of_camera("cam1", right), options, scan);
  for (const auto& [i, j] : pairs.pairs)
    scan.sequence.frames.push_back({left[i].stamp_ns, left[i].image, right[j].image});
  report_alone(mav / "cam0", left, pairs.left_alone, pairs, scan);
  report_alone(mav / "cam1", right, pairs.right_alone, pairs, scan);
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
    fail(file,
         "contains poses of the body, but the calibration is without T_BS; the ground truth is left out");
  }
  const Trajectory truth = read_trajectory(file, TrajectoryFormat::kEuroc);
  set_ground_truth(sequence, truth.stamps_ns, truth.poses, file);
}

/// Throws if an image has another size than the calibration says.
void require_size(const fs::path& file, const cv::Size& calibrated) {
  const ImageHeader header = check_image(file);
  if (cv::Size(header.width_px, header.height_px) == calibrated) return;
  fail(file,
       "is {}x{} pixels, but the resolution of the calibration is {}x{}; use the calibration of these images",
       header.width_px, header.height_px, calibrated.width, calibrated.height);
}

}  // namespace

bool looks_like_euroc(const fs::path& folder) {
  return fs::is_directory(folder / "mav0") || fs::exists(folder / "cam0/data.csv") ||
         fs::exists(folder / "cam1/data.csv");
}

SequenceScan scan_euroc(const fs::path& folder, const PairingOptions& pairing) {
  const fs::path mav = fs::is_directory(folder / "mav0") ? folder / "mav0" : folder;
  SequenceScan scan;
  StereoSequence& sequence = scan.sequence;
  auto& problems = scan.problems;
  sequence.folder = folder;
  sequence.format = "euroc";
  sequence.left_name = "cam0";
  sequence.right_name = "cam1";
  if (!fs::is_directory(mav / "cam0") || !fs::is_directory(mav / "cam1")) {
    problems.push_back(Problem::error(mav, "has no cam0 and cam1; expected {}", kEurocLayout));
    return scan;
  }
  std::vector<Row> left;
  std::vector<Row> right;
  attempt(problems, kError, [&] {
    const StereoRig rig = read_rig(mav);
    set_rig(sequence, rig, mav / "cam1");
  });
  attempt(problems, kError, [&] { left = read_rows(mav / "cam0"); });
  attempt(problems, kError, [&] { right = read_rows(mav / "cam1"); });
  if (left.empty() || right.empty()) return scan;
  attempt(problems, kError, [&] { pair_rows(mav, left, right, pairing, scan); });
  if (sequence.frames.empty() || !sequence.rectifier) return scan;
  const cv::Size left_size = sequence.rectifier->left_size();
  const cv::Size right_size = sequence.rectifier->right_size();
  attempt(problems, kError, [&] { require_size(sequence.frames.front().left, left_size); });
  if (right_size != left_size)
    attempt(problems, kError, [&] { require_size(sequence.frames.front().right, right_size); });
  attempt(problems, kWarning, [&] { read_ground_truth(mav, sequence); });
  return scan;
}

}  // namespace stereo_slam
