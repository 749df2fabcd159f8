// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/own_camera.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/dataset/image_file.hpp"
#include "stereo_slam/dataset/rig_file.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

constexpr auto kError = Problem::Severity::kError;
constexpr auto kWarning = Problem::Severity::kWarning;

[[noreturn]] void fail(const fs::path& file, const std::string& what) {
  throw std::runtime_error(fmt::format("{}: {}", file.string(), what));
}

/// Natural order: digits compare as numbers, img9 before img10.
bool natural_less(const std::string& a, const std::string& b) {
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
      continue;
    }
    const auto number = [&](const std::string& text, std::size_t& at) {
      while (at < text.size() && text[at] == '0') ++at;
      const std::size_t begin = at;
      while (at < text.size() && is_digit(text[at])) ++at;
      return text.substr(begin, at - begin);
    };
    const std::string x = number(a, i);
    const std::string y = number(b, j);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  if (i < a.size() || j < b.size()) return j < b.size();
  return a < b;
}

std::vector<fs::path> list_images(const fs::path& folder) {
  if (!fs::is_directory(folder)) fail(folder, "no such folder; it must contain the images of one camera");
  std::vector<fs::path> images;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file() && has_image_name(entry.path())) images.push_back(entry.path());
  }
  if (images.empty()) fail(folder, "contains no images (png, jpg, pgm, bmp, tif)");
  std::sort(images.begin(), images.end(), [](const auto& a, const auto& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return images;
}

/// The images by their names without extension; throws if two have the same.
std::map<std::string, fs::path> by_name(const std::vector<fs::path>& images) {
  std::map<std::string, fs::path> named;
  for (const auto& image : images) {
    const auto [other, is_new] = named.emplace(image.stem().string(), image);
    if (!is_new) {
      fail(image, fmt::format("has the name of {}; one image of a name must remain in the folder",
                              other->second.filename().string()));
    }
  }
  return named;
}

/// Pairs the images of both folders and fills the frames.
void pair_images(const std::vector<fs::path>& left, const std::vector<fs::path>& right, SequenceScan& scan) {
  auto& frames = scan.sequence.frames;
  const auto right_by_name = by_name(right);
  (void)by_name(left);
  for (const auto& image : left) {
    const auto partner = right_by_name.find(image.stem().string());
    if (partner != right_by_name.end()) frames.push_back({0, image, partner->second});
  }
  if (!frames.empty()) {
    const std::size_t alone = left.size() + right.size() - 2 * frames.size();
    if (alone > 0) {
      scan.problems.push_back(
          {kWarning,
           fmt::format("{}: {} images have no partner of the same name in the other folder; they are left "
                       "out",
                       scan.sequence.folder.string(), alone)});
    }
    return;
  }
  if (left.size() != right.size()) {
    fail(left.front().parent_path(),
         fmt::format(
             "holds {} images and {} holds {}, without a name in common; give the images of a pair one "
             "name",
             left.size(), right.front().parent_path().string(), right.size()));
  }
  for (std::size_t i = 0; i < left.size(); ++i) frames.push_back({0, left[i], right[i]});
}

/// A name of 13 digits or more is a stamp in nanoseconds.
std::optional<std::int64_t> stamp_in_name(const fs::path& image) {
  const std::string name = image.stem().string();
  constexpr std::size_t kMinDigits = 13;
  const auto stamp_ns = parse_nanoseconds(name);
  return name.size() >= kMinDigits && stamp_ns && *stamp_ns >= 0 ? stamp_ns : std::nullopt;
}

void read_times(const fs::path& file, std::vector<StereoFiles>& frames) {
  if (!fs::exists(file)) fail(file, "missing; it must contain one time in seconds per frame");
  const auto lines = read_text_lines(file);
  if (lines.size() != frames.size()) {
    fail(file,
         fmt::format("has {} times for {} frames; there must be one for each", lines.size(), frames.size()));
  }
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto stamp_ns = parse_seconds(split_fields(lines[i].text).front());
    if (!stamp_ns)
      throw std::runtime_error(
          at_line(file, lines[i].number, fmt::format("'{}' is not one time in seconds", lines[i].text)));
    if (i > 0 && *stamp_ns <= frames[i - 1].stamp_ns) {
      throw std::runtime_error(at_line(
          file, lines[i].number,
          fmt::format("{} is not later than the time before it; times must increase", lines[i].text)));
    }
    frames[i].stamp_ns = *stamp_ns;
  }
}

/// Stamps from the file of times, else from the names, else from the frame rate.
void set_stamps(const OwnCamera& own, const fs::path& calibration, double video_rate_hz,
                std::vector<StereoFiles>& frames) {
  if (own.times) return read_times(calibration.parent_path() / *own.times, frames);
  const bool named = video_rate_hz == 0.0 && std::all_of(frames.begin(), frames.end(), [](const auto& frame) {
                       return stamp_in_name(frame.left).has_value();
                     });
  if (named) {
    for (auto& frame : frames) frame.stamp_ns = *stamp_in_name(frame.left);
    const auto repeated = std::adjacent_find(
        frames.begin(), frames.end(), [](const auto& a, const auto& b) { return a.stamp_ns >= b.stamp_ns; });
    if (repeated != frames.end()) fail(repeated->left, "has the same stamp as the image after it");
    return;
  }
  const double rate_hz = own.frame_rate_hz.value_or(video_rate_hz);
  if (!(rate_hz > 0.0)) {
    fail(calibration, "has no times; add frame_rate_hz, or times: FILE with one time in seconds per frame");
  }
  for (std::size_t i = 0; i < frames.size(); ++i)
    frames[i].stamp_ns = std::llround(1e9 * static_cast<double>(i) / rate_hz);
}

/// The path of a source. A name without extension is a folder or else the only video of that name.
fs::path find_source(const fs::path& parent, const std::string& name) {
  const fs::path source = parent / name;
  if (fs::exists(source)) return source;
  for (const auto* extension : {".mp4", ".avi", ".mkv", ".mov", ".webm", ".m4v", ".mpg"}) {
    if (fs::exists(source.string() + extension)) return source.string() + extension;
  }
  return source;
}

void open_folders(const fs::path& left, const fs::path& right, const OwnCamera& own,
                  const fs::path& calibration, SequenceScan& scan) {
  pair_images(list_images(left), list_images(right), scan);
  set_stamps(own, calibration, 0.0, scan.sequence.frames);
}

void open_videos(const fs::path& left, const fs::path& right, const OwnCamera& own,
                 const fs::path& calibration, SequenceScan& scan) {
  auto& sequence = scan.sequence;
  auto video = std::make_shared<VideoPair>(left, right);
  sequence.frames.assign(video->frames(), {0, left, right});
  const auto [left_count, right_count] = video->frames_of_each();
  if (left_count != right_count) {
    scan.problems.push_back(
        {kWarning,
         fmt::format("{}: has {} frames and {} has {}; the shorter one counts; frames with the same index "
                     "must have been taken together",
                     left.string(), left_count, right.string(), right_count)});
  }
  set_stamps(own, calibration, video->rate_hz(), sequence.frames);
  sequence.video = std::move(video);
}

/// Size of the first left image.
cv::Size first_size(const StereoSequence& sequence) {
  const auto& file = sequence.frames.front().left;
  if (sequence.video) {
    const auto images = sequence.video->read(0);
    if (!images) fail(file, "contains no frame that can be decoded");
    return images->first.size();
  }
  const ImageHeader header = check_image(file);
  return {header.width_px, header.height_px};
}

void set_camera(const OwnCamera& own, const fs::path& calibration, StereoSequence& sequence) {
  const cv::Size size = first_size(sequence);
  if (own.rig) {
    try {
      set_rig(sequence, *own.rig);
    } catch (const std::runtime_error& error) {
      fail(calibration, error.what());
    }
    auto& camera = sequence.camera;
    if (camera.width_px != size.width || camera.height_px != size.height) {
      fail(calibration,
           fmt::format("resolution is {}x{}, but {} has {}x{} pixels; calibrate at the recorded size",
                       camera.width_px, camera.height_px, sequence.frames.front().left.string(), size.width,
                       size.height));
    }
    return;
  }
  sequence.camera = *own.rectified;
  sequence.camera.width_px = size.width;
  sequence.camera.height_px = size.height;
  sequence.T_body_camera = own.T_body_camera;
  const auto& camera = sequence.camera;
  if (!(camera.cx > 0.0 && camera.cx < size.width && camera.cy > 0.0 && camera.cy < size.height)) {
    fail(calibration, fmt::format("the principal point ({:.6g}, {:.6g}) lies outside the {}x{} images",
                                  camera.cx, camera.cy, size.width, size.height));
  }
}

}  // namespace

bool is_calibration_file(const fs::path& file) {
  return fs::is_regular_file(file) && (file.extension() == ".yaml" || file.extension() == ".yml");
}

SequenceScan scan_own_camera(const fs::path& calibration, std::string_view format) {
  SequenceScan scan;
  auto& sequence = scan.sequence;
  sequence.folder = calibration.parent_path();
  sequence.format = format == "auto" ? "folders" : format;
  attempt(scan.problems, kError, [&] {
    const OwnCamera own = read_own_camera(calibration);
    const fs::path left = find_source(calibration.parent_path(), own.left_source);
    const fs::path right = find_source(calibration.parent_path(), own.right_source);
    for (const auto& source : {left, right}) {
      if (!fs::exists(source)) {
        fail(source, fmt::format("neither a folder of images nor a video; correct 'source' in {}",
                                 calibration.filename().string()));
      }
    }
    if (fs::equivalent(left, right)) fail(left, "is the source of both cameras; each needs its own");
    if (format == "auto") sequence.format = fs::is_directory(left) ? "folders" : "video";
    sequence.left_name = left.filename();
    sequence.right_name = right.filename();
    (sequence.format == "video" ? open_videos : open_folders)(left, right, own, calibration, scan);
    if (sequence.frames.size() < 2)
      fail(left, fmt::format("contains {} frames; a sequence needs at least two", sequence.frames.size()));
    set_camera(own, calibration, sequence);
  });
  return scan;
}

}  // namespace stereo_slam
