// SPDX-License-Identifier: MIT
// The part of sequence.hpp that reads and scales the images.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <sys/resource.h>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/images/grey_image.hpp"
#include "stereo_slam/images/image_file.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

cv::Size size_of(const StereoSequence& sequence) {
  return {sequence.camera.width_px, sequence.camera.height_px};
}

/// The file of the left or right image of a frame; in a bag, video or live camera, its name and the frame.
std::string image_name(const StereoSequence& sequence, std::size_t index, bool is_left) {
  if (sequence.source) {
    return fmt::format("{}: frame {} of {}", sequence.folder.string(), index,
                       is_left ? sequence.left_name : sequence.right_name);
  }
  const StereoFiles& files = sequence.frames.at(index);
  return (is_left ? files.left : files.right).string();
}

/// Makes an image of another size than the camera's an unreadable one.
void check_size(const StereoSequence& sequence, std::size_t index, bool is_left, RawPair& pair) {
  const cv::Size recorded = recorded_size(sequence, is_left);
  cv::Mat& image = is_left ? pair.left : pair.right;
  if (image.empty() || image.size() == recorded) return;
  (is_left ? pair.left_fault : pair.right_fault) =
      wrong_size(image_name(sequence, index, is_left), image.size(), recorded).text;
  image.release();
}

RawPair read_source(const StereoSequence& sequence, std::size_t index) {
  auto images = sequence.source->read(index);
  if (images) return std::move(*images);
  throw EndOfRecording(sequence.live ? fmt::format("{}: delivers no more images", sequence.folder.string())
                                     : fmt::format("{}: the video ends at frame {}, its header promises {}",
                                                   sequence.folder.string(), index, sequence.frames.size()));
}

/// Both images of a file that shows them side by side.
RawPair read_both(const StereoSequence& sequence, const fs::path& file) {
  RawPair pair;
  const cv::Mat both = load_or_fault([&] { return load_gray_image(file, sequence.scale); }, pair.left_fault);
  try {
    if (!both.empty()) return split(both);
  } catch (const std::invalid_argument& error) {
    pair.left_fault = fmt::format("{}: {}", file.string(), error.what());
  }
  pair.right_fault = pair.left_fault;
  return pair;
}

/// Both images of a frame whose files show them side by side. It has two files if its right image is that of
/// another frame.
RawPair read_side_by_side(const StereoSequence& sequence, const StereoFiles& files) {
  if (files.right.empty() || files.right == files.left) return read_both(sequence, files.left);
  RawPair pair = read_both(sequence, sequence.right_half_first ? files.right : files.left);
  RawPair other = read_both(sequence, sequence.right_half_first ? files.left : files.right);
  pair.right = std::move(other.right);
  pair.right_fault = std::move(other.right_fault);
  return pair;
}

RawPair read_recorded(const StereoSequence& sequence, std::size_t index) {
  if (sequence.source) return read_source(sequence, index);
  const StereoFiles& files = sequence.frames.at(index);
  if (sequence.side_by_side) return read_side_by_side(sequence, files);
  RawPair pair;
  pair.left = load_or_fault([&] { return load_gray_image(files.left, sequence.scale); }, pair.left_fault);
  pair.right = load_or_fault([&] { return load_gray_image(files.right, sequence.scale); }, pair.right_fault);
  return pair;
}

RawPair read_frame(const StereoSequence& sequence, std::size_t index) {
  RawPair pair = read_recorded(sequence, index);
  if (sequence.right_half_first) {
    std::swap(pair.left, pair.right);
    std::swap(pair.left_fault, pair.right_fault);
  }
  return pair;
}

/// The raw left image of one frame and the right one of another, scaled; one that cannot be read is empty.
RawPair load_images(const StereoSequence& sequence, std::size_t left, std::size_t right) {
  RawPair pair = read_frame(sequence, left);
  if (right != left) {
    RawPair other = read_frame(sequence, right);
    pair.right = std::move(other.right);
    pair.right_fault = std::move(other.right_fault);
  }
  check_size(sequence, left, /*is_left=*/true, pair);
  check_size(sequence, right, /*is_left=*/false, pair);
  if (sequence.unscaled.empty()) return pair;
  for (const bool is_left : {true, false}) {  // before rectification, which takes less time then
    cv::Mat& image = is_left ? pair.left : pair.right;
    if (image.empty()) continue;
    cv::Mat scaled;
    cv::resize(image, scaled, image_size(sequence, is_left), 0.0, 0.0, cv::INTER_AREA);
    image = scaled;
  }
  return pair;
}

/// The rectified frame of a raw pair; an image that could not be read is black.
StereoFrame rectified(const StereoSequence& sequence, std::size_t index, RawPair pair) {
  const auto prepare = [&](const cv::Mat& image, bool is_left) -> cv::Mat {
    if (image.empty()) return cv::Mat::zeros(size_of(sequence), CV_8UC1);
    if (!sequence.rectifier) return image;
    return is_left ? sequence.rectifier->left(image) : sequence.rectifier->right(image);
  };
  return {.index = index,
          .stamp_ns = pair.stamp_ns ? *pair.stamp_ns : sequence.frames.at(index).stamp_ns,
          .left = prepare(pair.left, true),
          .right = prepare(pair.right, false),
          .left_fault = std::move(pair.left_fault),
          .right_fault = std::move(pair.right_fault)};
}

/// How many images have 8 and 16 bits a pixel.
struct DepthCounts {
  std::size_t of_8_bits = 0;
  std::size_t of_16_bits = 0;
};

/// Adds the values of those images of a pair that have 16 bits a pixel.
void add_values(const StereoSequence& sequence, std::size_t index, ValueCounts& values, DepthCounts& depths) {
  if (sequence.source) {
    (sequence.source->add_values(index, values) ? depths.of_16_bits : depths.of_8_bits) += 2;
    return;
  }
  const StereoFiles& files = sequence.frames[index];
  for (const auto& file : {files.left, files.right}) {
    if (file.empty()) continue;  // side by side
    const cv::Mat image = load_16_bit_image(file);
    ++(image.empty() ? depths.of_8_bits : depths.of_16_bits);
    if (!image.empty()) values.add(image);
  }
}

/// What is said of images that are not read as 16 bits.
[[nodiscard]] std::string scale_text(const StereoSequence& sequence, const ValueCounts& values,
                                     std::size_t pairs) {
  const std::string images =
      fmt::format("{}: the images have 16 bits a pixel, but", sequence.folder.string());
  const int bits = values.bits();
  if (sequence.scale == GreyScale::of_bits(bits)) {
    return fmt::format(
        "{} no value is above {} in the {} pairs examined; they are read as images of {} bits, and larger "
        "values as white",
        images, (1 << bits) - 1, pairs, bits);
  }
  if (sequence.scale.by_median) {
    return fmt::format(
        "{} the values in one image differ by {:.0f} only, and those of the {} pairs examined lie from "
        "{:.0f} to {:.0f}, as they drift or differ between the cameras; the median of each image is read as "
        "medium grey, and every {:.1f} values as one grey level",
        images, values.range_of_one(), pairs, values.quantile(ValueCounts::kTail),
        values.quantile(1.0 - ValueCounts::kTail), sequence.scale.step);
  }
  return fmt::format(
      "{} {:.0f} % of the values in the {} pairs examined are from {:.0f} to {:.0f}; in all frames {:.0f} is "
      "read as black and {:.0f} as white",
      images, 100.0 * (1.0 - 2.0 * ValueCounts::kTail), pairs, values.quantile(ValueCounts::kTail),
      values.quantile(1.0 - ValueCounts::kTail), sequence.scale.black,
      sequence.scale.black + 255.0 * sequence.scale.step);
}

/// The two scale factors are those of the rounded size.
template <class Camera>
[[nodiscard]] Camera scaled(Camera camera, const cv::Size& size) {
  const double x = static_cast<double>(size.width) / camera.width_px;
  const double y = static_cast<double>(size.height) / camera.height_px;
  camera.fx *= x;
  camera.fy *= y;
  camera.cx = (camera.cx + 0.5) * x - 0.5;  // the centre of the first pixel is at 0
  camera.cy = (camera.cy + 0.5) * y - 0.5;
  camera.width_px = size.width;
  camera.height_px = size.height;
  return camera;
}

/// The number in a file of the kernel; infinite if there is none, as where it says "max".
[[nodiscard]] double number_in(const fs::path& file) {
  std::ifstream stream(file);
  double value = 0.0;
  return stream >> value ? value : std::numeric_limits<double>::infinity();
}

/// The memory that this process may use: that of the machine, of its container or of `ulimit -v`.
[[nodiscard]] double available_bytes() {
  const auto pages = static_cast<double>(sysconf(_SC_PHYS_PAGES));
  double bytes = pages * static_cast<double>(sysconf(_SC_PAGESIZE));
  if (!(bytes > 0.0)) bytes = std::numeric_limits<double>::infinity();
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
    bytes = std::min(bytes, static_cast<double>(limit.rlim_cur));
  for (const auto* file : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"})
    bytes = std::min(bytes, number_in(file));
  return bytes;
}

}  // namespace

void find_scale(SequenceScan& scan) {
  constexpr std::size_t kMostPairs = 16;
  auto& sequence = scan.sequence;
  const std::size_t frames = sequence.frames.size();
  const std::size_t sampled = std::min(kMostPairs, frames);
  ValueCounts values;
  DepthCounts depths;
  std::size_t pairs = 0;
  // The last pair comes second: if neither it nor the first one has 16 bits, none is expected to.
  for (std::size_t i = 0; i < sampled; ++i) {
    const std::size_t place = i == 0 ? 0 : i == 1 ? sampled - 1 : i - 1;
    try {
      add_values(sequence, place * (frames - 1) / std::max<std::size_t>(sampled - 1, 1), values, depths);
      ++pairs;
    } catch (const std::runtime_error&) {  // an image that cannot be read is reported where it is loaded
    }
    const bool enough = i > 0 || sequence.source;  // reading the end of a source takes time
    if (enough && pairs > 0 && depths.of_16_bits == 0) return;
  }
  if (depths.of_16_bits == 0) return;
  const bool mixed = depths.of_8_bits > 0;
  if (mixed) {
    scan.warn(
        sequence.folder,
        "{} of the {} images examined have 8 bits a pixel and {} have 16, which are reduced to 8; store "
        "all of them alike, or check that both have the same brightness",
        depths.of_8_bits, depths.of_8_bits + depths.of_16_bits, depths.of_16_bits);
  }
  if (values.have_exchanged_bytes()) {
    scan.problems.push_back(
        Problem::error(sequence.folder,
                       "the two bytes of the values of 16 bits look exchanged: the images "
                       "look like noise, and the other way round like images; write them "
                       "again, in PNG and PGM with the upper byte first, else as the "
                       "header says"));
    return;
  }
  if (values.scale() == GreyScale{}) return;
  sequence.scale = values.scale();
  if (sequence.source) sequence.source->use_scale(sequence.scale);
  scan.problems.push_back({Problem::Severity::kWarning, scale_text(sequence, values, pairs)});
}

void scale_images(SequenceScan& scan, double factor) {
  constexpr int kLeast_px = 32;
  auto& sequence = scan.sequence;
  const cv::Size left = image_size(sequence, true);
  const cv::Size right = image_size(sequence, false);
  if (factor == 1.0 || left.empty()) return;
  const auto times_factor = [&](const cv::Size& size) {
    return cv::Size(static_cast<int>(std::lround(factor * size.width)),
                    static_cast<int>(std::lround(factor * size.height)));
  };
  const cv::Size size = times_factor(left);
  attempt(scan.problems, Problem::Severity::kError, [&] {
    if (std::min(size.width, size.height) < kLeast_px) {
      fail(sequence.folder, "--scale {} makes images of {}x{} pixels; they need {} a side", factor,
           size.width, size.height, kLeast_px);
    }
    sequence.unscaled = left;
    sequence.unscaled_right = right;
    if (!sequence.rectifier) {
      sequence.camera = scaled(sequence.camera, size);
      return;
    }
    StereoRig rig = *sequence.rig;
    rig.left = scaled(rig.left, size);
    rig.right = scaled(rig.right, times_factor(right));
    set_rig(sequence, rig);
  });
}

void check_memory(SequenceScan& scan) {
  constexpr double kBytesPerPixel = 65.0;  // of a run with raw images, measured at 20 megapixels
  constexpr double kMostShare = 0.5;
  const auto& camera = scan.sequence.camera;
  const double needed = kBytesPerPixel * camera.width_px * camera.height_px;
  const double available = kMostShare * available_bytes();
  if (needed <= available) return;
  scan.too_large = true;
  const double already = scan.sequence.unscaled.empty()
                             ? 1.0
                             : static_cast<double>(camera.width_px) / scan.sequence.unscaled.width;
  const double percent = std::floor(100.0 * already * std::sqrt(available / needed));
  scan.problems.push_back(
      Problem::error(scan.sequence.folder,
                     "with images of {} x {} pixels a run needs {:.2g} GB, more than half of the {:.2g} GB "
                     "that it may use; scale them, as by --scale {}",
                     camera.width_px, camera.height_px, 1e-9 * needed, 1e-9 * available / kMostShare,
                     std::max(0.01, 0.01 * percent)));
}

RawPair load_raw_pair(const StereoSequence& sequence, std::size_t left, std::size_t right) {
  RawPair pair = load_images(sequence, left, right);
  require_complete(pair);
  return pair;
}

bool has_one_image_twice(const StereoSequence& sequence, std::size_t index) {
  const auto pair = load_raw_pair(sequence, index, index);
  return pair.left.size() == pair.right.size() && cv::norm(pair.left, pair.right, cv::NORM_INF) == 0.0;
}

StereoFrame load_frame(const StereoSequence& sequence, std::size_t index, const ImageSettings& settings) {
  StereoFrame frame = rectified(sequence, index, load_raw_pair(sequence, index, index));
  equalise_contrast(frame, settings);
  return frame;
}

StereoFrame load_partial_frame(const StereoSequence& sequence, std::size_t index,
                               const ImageSettings& settings) {
  StereoFrame frame = rectified(sequence, index, load_images(sequence, index, index));
  equalise_contrast(frame, settings);
  return frame;
}

}  // namespace stereo_slam
