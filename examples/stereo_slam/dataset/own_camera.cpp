// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/own_camera.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/calibration/calibration_file.hpp"
#include "stereo_slam/dataset/frame_positions.hpp"
#include "stereo_slam/dataset/image_folders.hpp"
#include "stereo_slam/images/image_file.hpp"
#include "stereo_slam/images/live_camera.hpp"
#include "stereo_slam/images/video.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/folder_names.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/stamps/stamp_units.hpp"
#include "stereo_slam/stamps/times_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

constexpr auto kError = Problem::Severity::kError;
constexpr auto kWarning = Problem::Severity::kWarning;

void set_times(const fs::path& file, const FramePositions& positions, SequenceScan& scan) {
  auto& frames = scan.sequence.frames;
  if (!fs::exists(file)) fail(file, "missing; it must contain one time in seconds per frame");
  const auto [stamps_ns, warning] = read_times(file);
  if (!warning.empty()) scan.problems.push_back({kWarning, warning});
  const bool of_all = stamps_ns.size() == positions.count;
  if (!of_all && stamps_ns.size() != frames.size()) {
    fail(file, "has {} for {}; there must be one for each", counted(stamps_ns.size(), "time"),
         counted(frames.size(), "frame"));
  }
  for (std::size_t i = 0; i < frames.size(); ++i)
    frames[i].stamp_ns = stamps_ns[of_all ? positions.of_frame[i] : i];
}

/// What is known about the times of frames besides a file of times.
struct KnownTimes {
  FramePositions positions;
  NameTimes in_names{};        ///< of the left images
  double video_rate_hz = 0.0;  ///< 0 if it is not known
};

/// Warns if the frame rate of the calibration is not that of the stamps in the names.
void compare_rates(double frame_rate_hz, const NameTimes& times, SequenceScan& scan) {
  constexpr double kMostTimes = 1.5;
  const auto interval_ns = static_cast<double>(usual_interval_ns(times.stamps_ns));
  if (!(interval_ns > 0.0)) return;
  const double rate_hz = 1e9 / interval_ns;
  if (rate_hz < kMostTimes * frame_rate_hz && frame_rate_hz < kMostTimes * rate_hz) return;
  scan.warn(scan.sequence.folder,
            "the stamps in the names of the images give {:.4g} frames per second, but frame_rate_hz is "
            "{:.4g}; the stamps are used",
            rate_hz, frame_rate_hz);
}

/// Stamps from the file of times, else from the names, where the frames have them already, else from the
/// frame rate.
void set_stamps(const OwnCamera& own, const fs::path& calibration, const KnownTimes& known,
                SequenceScan& scan) {
  auto& frames = scan.sequence.frames;
  if (own.times) return set_times(calibration.parent_path() / *own.times, known.positions, scan);
  if (!known.in_names.stamps_ns.empty()) {
    if (own.frame_rate_hz) compare_rates(*own.frame_rate_hz, known.in_names, scan);
    return;
  }
  const fs::path usual_times = frames.front().left.parent_path().parent_path() / "times.txt";
  const double rate_hz = own.frame_rate_hz.value_or(known.video_rate_hz);
  if (!(rate_hz > 0.0) && fs::exists(usual_times)) return set_times(usual_times, known.positions, scan);
  if (!(rate_hz > 0.0)) {
    const std::string& doubt = known.in_names.doubt;
    fail(calibration,
         "has no times{}; add frame_rate_hz, or times: FILE with one time in seconds per frame, or put "
         "times.txt beside the folders of the images",
         doubt.empty() ? "" : ", and those in the names of the images have no certain unit: " + doubt);
  }
  for (std::size_t i = 0; i < frames.size(); ++i)
    frames[i].stamp_ns = std::llround(1e9 * static_cast<double>(known.positions.of_frame[i]) / rate_hz);
}

/// The path of a source. A name without extension is a folder or else the only video of that name.
fs::path find_source(const fs::path& parent, const std::string& name) {
  fs::path source = parent / name;
  std::error_code error;  // as of a pipeline that is too long for a name
  if (fs::exists(source, error)) return source;
  return is_live(name) ? fs::path(name) : find_video(source);
}

/// Where the images of the cameras come from, and how they become pairs.
struct Sources {
  fs::path left;   ///< of both cameras, if they are side by side
  fs::path right;  ///< empty if they are side by side
  PairingOptions pairing{};

  [[nodiscard]] bool side_by_side() const { return right.empty(); }
};

/// The sources that the calibration names, in a folder.
Sources sources_in(const fs::path& folder, const OwnCamera& own) {
  if (own.source) return {.left = find_source(folder, *own.source), .right = {}};
  return {.left = find_source(folder, own.left_source), .right = find_source(folder, own.right_source)};
}

Sources sources_of(const OwnCamera& own, const OwnCameraFiles& files) {
  if (files.dataset.empty()) return sources_in(files.calibration.parent_path(), own);
  if (fs::is_directory(files.dataset)) return sources_in(files.dataset, own);
  const std::string names = files.dataset.string();
  const auto comma = names.find(',');
  const bool two =
      comma != std::string::npos && !fs::exists(files.dataset) && names.find(" ! ") == std::string::npos;
  return two ? Sources{.left = names.substr(0, comma), .right = names.substr(comma + 1)}
             : Sources{.left = files.dataset, .right = {}};
}

/// The name of the right camera's folder that belongs to one of the left camera, as cam1 to cam0; empty if it
/// tells no side.
std::string right_name_of(std::string name) {
  if (name == "l" || name == "L") return name == "l" ? "r" : "R";
  for (const auto& [left, right] : {std::pair("left", "right"), {"Left", "Right"}, {"LEFT", "RIGHT"}}) {
    const auto at = name.rfind(left);
    if (at != std::string::npos) return name.replace(at, std::string_view(left).size(), right);
  }
  for (const auto& [left, right] : {std::pair("0", "1"), {"1", "2"}, {"_l", "_r"}, {"_L", "_R"}}) {
    if (name.ends_with(left))
      return name.replace(name.size() - std::string_view(left).size(), name.size(), right);
  }
  return "";
}

/// What to write into the calibration if the images are in folders under other names; empty if none are seen.
std::string source_advice(const fs::path& folder) {
  std::vector<fs::path> searched = folders_in(folder);
  searched.insert(searched.begin(), folder);
  for (const auto& parent : searched) {
    const auto folders = folders_in(parent);
    for (const auto& left : folders) {
      const fs::path right = parent / right_name_of(left.filename().string());
      if (std::ranges::find(folders, right) == folders.end()) continue;
      return fmt::format(
          "; if the images are in {0} and {1}, add 'left: {{source: {0}}}' and 'right: {{source: {1}}}'",
          left.lexically_relative(folder).string(), right.lexically_relative(folder).string());
    }
  }
  return "";
}

void check_sources(const Sources& sources, const OwnCameraFiles& files) {
  for (const auto& source : {sources.left, sources.right}) {
    if (source.empty() || is_live(source) || fs::exists(source)) continue;
    const fs::path folder = source.parent_path();
    const std::string names = names_in(folder);
    const bool named_in_file = files.dataset.empty() || fs::is_directory(files.dataset);
    fail(source, "neither a folder of images nor a video; correct {}'source' in {}{}{}",
         files.dataset.empty() ? "" : "--dataset, or ", files.calibration.filename().string(),
         names.empty() ? "" : fmt::format("; {} has {}", folder.string(), names),
         named_in_file
             ? source_advice(files.dataset.empty() ? files.calibration.parent_path() : files.dataset)
             : "");
  }
  if (sources.side_by_side()) return;
  if (is_live(sources.left) != is_live(sources.right))
    fail(sources.left, "one source is a live camera and the other is not; record both, or read both live");
  const bool same =
      is_live(sources.left) ? sources.left == sources.right : fs::equivalent(sources.left, sources.right);
  if (same) fail(sources.left, "is the source of both cameras; each needs its own");
}

/// The pairs of the left and the right images, and what their names say about times.
KnownTimes open_pairs(const ImageList& left, const ImageList& right, const PairingOptions& pairing,
                      SequenceScan& scan) {
  pair_images(left, right, pairing, scan);
  const auto& first = scan.sequence.frames.front();
  const bool same_names = first.left.stem() == first.right.stem();
  return {.positions = positions_of(scan.sequence.frames, left, same_names ? right : ImageList{}),
          .in_names = left.times};
}

void open_folders(const Sources& sources, const OwnCamera& own, const fs::path& calibration,
                  SequenceScan& scan) {
  auto& sequence = scan.sequence;
  const ImageList left = list_images(sources.left);
  KnownTimes known;
  if (sources.side_by_side()) {
    const auto& stamps_ns = left.times.stamps_ns;
    for (std::size_t i = 0; i < left.files.size(); ++i)
      sequence.frames.push_back({stamps_ns.empty() ? 0 : stamps_ns[i], left.files[i], left.files[i]});
    sequence.side_by_side = true;
    known = {.positions = positions_of(sequence.frames, left, {}), .in_names = left.times};
  } else {
    known = open_pairs(left, list_images(sources.right), sources.pairing, scan);
  }
  if (known.positions.missing > 0) {
    scan.warn(sources.left, "{} missing among the names of the images; the stamps leave time for this",
              counted(known.positions.missing, "number is", "numbers are"));
  }
  set_stamps(own, calibration, known, scan);
}

void require_frames(const fs::path& video, std::size_t count) {
  if (count == 0)
    fail(video, "is a video without frames that can be decoded; record, copy or convert it again");
}

void open_videos(const Sources& sources, const OwnCamera& own, const fs::path& calibration,
                 SequenceScan& scan) {
  auto& sequence = scan.sequence;
  auto video = std::make_shared<VideoPair>(sources.left, sources.right);
  const auto [left_count, right_count] = video->frames_of_each();
  require_frames(sources.left, left_count);
  require_frames(sources.right, right_count);
  sequence.frames.assign(video->frames(),
                         {0, sources.left, sources.side_by_side() ? sources.left : sources.right});
  if (left_count != right_count) {
    scan.warn(sources.left,
              "has {} and {} has {}; the shorter one counts; frames with the same index must have been taken "
              "together",
              counted(left_count, "frame"), sources.right.string(), right_count);
  }
  if (!own.times && !own.frame_rate_hz) video->use_own_times();
  set_stamps(
      own, calibration,
      {.positions = FramePositions::without_gaps(sequence.frames.size()), .video_rate_hz = video->rate_hz()},
      scan);
  sequence.source = std::move(video);
}

void open_camera(const Sources& sources, SequenceScan& scan) {
  scan.sequence.live = true;
  scan.sequence.source = std::make_shared<LiveCamera>(sources.left, sources.right);
}

void open_sources(const Sources& sources, const OwnCamera& own, const fs::path& calibration,
                  SequenceScan& scan) {
  auto& sequence = scan.sequence;
  sequence.left_name = sources.left.filename();
  sequence.right_name = (sources.side_by_side() ? sources.left : sources.right).filename();
  sequence.right_half_first = sources.pairing.right_half_first;
  if (sequence.right_half_first && !sources.side_by_side())
    fail(sources.left,
         "is not of images side by side, so --right-half-first does not apply; exchange the sources");
  if (sequence.format == "camera") return open_camera(sources, scan);
  (sequence.format == "video" ? open_videos : open_folders)(sources, own, calibration, scan);
  if (sequence.frames.size() < 2) {
    fail(sources.left, "contains {}; a sequence needs at least two frames",
         sequence.frames.empty() ? "no frame" : "one frame");
  }
}

/// Size of an image file; empty for one that cannot be read, which is reported where it is loaded.
cv::Size size_or_none(const fs::path& image) {
  try {
    const ImageHeader header = check_image(image);
    return {header.width_px, header.height_px};
  } catch (const std::runtime_error&) {
    return {};
  }
}

/// Sizes of the first left and right image.
std::pair<cv::Size, cv::Size> first_sizes(const StereoSequence& sequence) {
  if (sequence.source) {
    const auto images = sequence.source->read(0);
    if (!images) fail(sequence.folder, "contains no frame that can be decoded");
    require_complete(*images);
    return {images->left.size(), images->right.size()};
  }
  const auto& files = sequence.frames.front();
  const ImageHeader header = check_image(files.left);
  const cv::Size left(sequence.side_by_side ? header.width_px / 2 : header.width_px, header.height_px);
  return {left, sequence.side_by_side ? left : size_or_none(files.right)};
}

/// Advice when the calibration and the images have different sizes.
std::string size_advice(const OwnCamera& own, const cv::Size& calibrated, const cv::Size& size) {
  if (!own.other_sizes.empty()) {
    std::string others;
    for (const auto& rig : own.other_sizes)
      others += fmt::format(" and {}x{}", rig.left.width_px, rig.left.height_px);
    return fmt::format("it is also of{}; record at one of these sizes", others.substr(4));
  }
  if (size.width == 2 * calibrated.width && size.height == calibrated.height)
    return "both cameras seem to be side by side in it: use `layout: side-by-side`";
  const double factor = static_cast<double>(size.width) / calibrated.width;
  if (std::abs(factor * calibrated.height - size.height) <= 1.0)
    return fmt::format("if it was only scaled, multiply fx, fy, cx and cy by {:.6g}", factor);
  return "calibrate at the recorded size";
}

/// Throws std::runtime_error if the images of a camera have another size than its calibration. An empty size
/// is not known.
void require_calibrated_size(const OwnCamera& own, const fs::path& calibration, const cv::Size& calibrated,
                             const cv::Size& size, const fs::path& image) {
  if (size.empty() || calibrated == size) return;
  fail(calibration, "resolution is {}x{}, but {} has {}x{} pixels; {}", calibrated.width, calibrated.height,
       image.string(), size.width, size.height, size_advice(own, calibrated, size));
}

void set_raw_camera(const OwnCamera& own, const fs::path& calibration,
                    const std::pair<cv::Size, cv::Size>& sizes, StereoSequence& sequence) {
  const StereoRig rig = rig_for(own, sizes.first, sizes.second);
  set_rig(sequence, rig, calibration);
  const auto& [left, right] = sizes;
  const bool live = sequence.live;
  require_calibrated_size(own, calibration, {rig.left.width_px, rig.left.height_px}, left,
                          live ? sequence.folder : sequence.frames.front().left);
  require_calibrated_size(own, calibration, {rig.right.width_px, rig.right.height_px}, right,
                          live ? sequence.folder : sequence.frames.front().right);
}

/// SN....conf of a ZED camera; empty if there is none. Throws if there are several.
fs::path find_zed_calibration(const fs::path& folder) {
  fs::path found;
  if (!fs::is_directory(folder)) return found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("SN") || entry.path().extension() != ".conf") continue;
    if (!found.empty())
      fail(folder, "holds {} and {}; keep that of the camera", found.filename().string(), name);
    found = entry.path();
  }
  return found;
}

}  // namespace

void set_camera(const OwnCamera& own, const fs::path& calibration, StereoSequence& sequence) {
  const auto sizes = first_sizes(sequence);
  if (own.rig) return set_raw_camera(own, calibration, sizes, sequence);
  const cv::Size& size = sizes.first;
  sequence.camera = *own.rectified;
  sequence.camera.width_px = size.width;
  sequence.camera.height_px = size.height;
  sequence.T_body_camera = own.T_body_camera;
  if (own.rectified->width_px > 0) {
    require_calibrated_size(own, calibration, {own.rectified->width_px, own.rectified->height_px}, size,
                            sequence.live ? sequence.folder : sequence.frames.front().left);
  }
  const auto& camera = sequence.camera;
  if (!(camera.cx > 0.0 && camera.cx < size.width && camera.cy > 0.0 && camera.cy < size.height)) {
    fail(calibration, "the principal point ({:.6g}, {:.6g}) lies outside the {}x{} images", camera.cx,
         camera.cy, size.width, size.height);
  }
}

bool is_calibration_file(const fs::path& file) {
  const auto extension = file.extension();
  const auto known = {".yaml", ".yml", ".xml", ".json", ".conf"};
  return fs::is_regular_file(file) && std::ranges::find(known, extension) != known.end();
}

fs::path find_calibration(const fs::path& folder) {
  for (const char* name : {kCalibrationFile.data(), "calibration.yml", "calibration.xml", "calibration.json",
                           "camchain.yaml", "left.yaml", "kalibr_imucam_chain.yaml", "ost.txt"}) {
    if (fs::is_directory(folder / name))
      fail(folder / name, "is a folder with the name of a calibration file; rename it");
    if (fs::exists(folder / name)) return folder / name;
  }
  return find_zed_calibration(folder);
}

SequenceScan scan_own_camera(const OwnCameraFiles& files, std::string_view format,
                             const PairingOptions& pairing) {
  SequenceScan scan;
  auto& sequence = scan.sequence;
  sequence.folder = files.dataset.empty() ? files.calibration.parent_path() : files.dataset;
  sequence.format = format == "auto" ? "folders" : format;
  attempt(scan.problems, kError, [&] {
    const OwnCamera own = read_calibration(files.calibration);
    for (const auto& warning : own.warnings) scan.problems.push_back({kWarning, warning});
    Sources sources = sources_of(own, files);
    sources.pairing = pairing;
    check_sources(sources, files);
    if (is_live(sources.left)) sequence.format = "camera";
    if (format == "auto" && !is_live(sources.left))
      sequence.format = fs::is_directory(sources.left) ? "folders" : "video";
    open_sources(sources, own, files.calibration, scan);
    set_camera(own, files.calibration, sequence);
  });
  return scan;
}

}  // namespace stereo_slam
