// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/image_folders.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/dataset/stamp_pairs.hpp"
#include "stereo_slam/images/image_file.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/folder_names.hpp"
#include "stereo_slam/stamps/image_names.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> names_of(const std::vector<fs::path>& images) {
  std::vector<std::string> names;
  names.reserve(images.size());
  for (const auto& image : images) names.push_back(image.stem().string());
  return names;
}

/// The images by their names without extension; throws if two have the same.
std::map<std::string, fs::path> by_name(const std::vector<fs::path>& images) {
  std::map<std::string, fs::path> named;
  for (const auto& image : images) {
    const auto [other, is_new] = named.emplace(image.stem().string(), image);
    if (!is_new) {
      fail(image, "has the name of {}; one image of a name must remain in the folder",
           other->second.filename().string());
    }
  }
  return named;
}

/// The images by the numbers of their frames; empty if their names are no text with such a number.
std::map<std::uint64_t, fs::path> by_frame_number(const std::vector<fs::path>& images) {
  std::map<std::uint64_t, fs::path> numbered;
  const std::string text = NumberedName(images.front().stem().string()).text;
  for (const auto& image : images) {
    const NumberedName name(image.stem().string());
    if (!name.number || name.text != text || !numbered.emplace(*name.number, image).second) return {};
  }
  return numbered;
}

/// Whether every number between the first and the last has an image.
bool is_complete(const std::map<std::uint64_t, fs::path>& numbered) {
  return numbered.rbegin()->first - numbered.begin()->first + 1 == numbered.size();
}

/// Fills the frames with pairs of the same number, if the names contain numbers and images are missing.
void pair_by_number(const std::vector<fs::path>& left, const std::vector<fs::path>& right,
                    std::vector<StereoFiles>& frames) {
  const auto left_numbered = by_frame_number(left);
  const auto right_numbered = by_frame_number(right);
  if (left_numbered.empty() || right_numbered.empty()) return;
  const bool as_many = left.size() == right.size();
  if (as_many && is_complete(left_numbered) && is_complete(right_numbered)) return;
  for (const auto& [number, image] : left_numbered) {
    const auto partner = right_numbered.find(number);
    if (partner != right_numbered.end()) frames.push_back({0, image, partner->second});
  }
}

/// Fills the frames with pairs in the order of the names. Warns if the names have numbers of frames, but none
/// is in both folders.
void pair_by_order(const std::vector<fs::path>& left, const std::vector<fs::path>& right,
                   SequenceScan& scan) {
  auto& frames = scan.sequence.frames;
  for (std::size_t i = 0; i < left.size(); ++i) frames.push_back({0, left[i], right[i]});
  const auto left_numbered = by_frame_number(left);
  const auto right_numbered = by_frame_number(right);
  const bool numbered = !left_numbered.empty() && !right_numbered.empty();
  const auto in_both = [&](const auto& image) { return right_numbered.contains(image.first); };
  if (!numbered || std::ranges::any_of(left_numbered, in_both)) return;
  scan.warn(scan.sequence.folder,
            "the images of the two cameras have no number in common, so they are paired by order, {} with "
            "{}; check that these were taken together, and give the images of a pair one name",
            left.front().filename().string(), right.front().filename().string());
}

/// What is before the number at the end of an image's name; nothing without a number. A stamp is a number.
std::optional<std::string> text_before_number(const fs::path& image) {
  std::string name = image.stem().string();
  const auto last_letter = name.find_last_not_of("0123456789.");
  if (last_letter == std::string::npos) return "";
  if (last_letter + 1 == name.size()) return std::nullopt;
  return name.substr(0, last_letter + 1);
}

/// Throws if most images are named by a number, alone or after one text, and another has no number at its
/// end, or letters before it while the others have none: 000004 (1), 000004 - Copy, mask. Recordings joined
/// of several, with a text each, pass.
void require_one_pattern(const std::vector<fs::path>& images) {
  std::map<std::string, std::size_t> counts;
  for (const auto& image : images) {
    if (const auto text = text_before_number(image)) ++counts[*text];
  }
  const auto most =
      std::ranges::max_element(counts, [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == counts.end() || 2 * most->second <= images.size()) return;
  for (const auto& image : images) {
    const auto text = text_before_number(image);
    if (text && (*text == most->first || !most->first.empty())) continue;
    const std::string pattern = most->first.empty() ? "digits only" : "'" + most->first + "' and a number";
    fail(image,
         "its name is not {}, as those of {} of the {} images are; remove it if it is a copy or no image of "
         "the recording, or rename it",
         pattern, most->second, images.size());
  }
}

/// Throws if names of different texts contain times: in which order they are is not known.
void require_no_mixed_times(const std::vector<fs::path>& images) {
  std::map<std::string, std::vector<std::string>> names;  // by what is between their numbers
  for (const auto& image : images) {
    const std::string name = image.stem().string();
    std::string text;
    std::copy_if(name.begin(), name.end(), std::back_inserter(text),
                 [](unsigned char c) { return std::isdigit(c) == 0; });
    names[text].push_back(name);
  }
  if (names.size() < 2) return;
  for (const auto& [text, alike] : names) {
    if (alike.size() < 2 || times_in(alike).keys.empty()) continue;
    const auto& other = names.begin()->first == text ? std::next(names.begin()) : names.begin();
    throw std::invalid_argument(
        fmt::format("{} contains a time, and {} has another text than it; give all images of the folder "
                    "names that differ in numbers only",
                    alike.front(), other->second.front()));
  }
}

/// The files with the times in their names, sorted by these, or in natural order.
ImageList in_order(const fs::path& folder, std::vector<fs::path> files) {
  std::ranges::sort(files, [](const auto& a, const auto& b) {
    return a.stem() != b.stem() ? natural_less(a.stem().string(), b.stem().string())
                                : a.extension() < b.extension();
  });
  ImageList list;
  try {
    list.times = times_in(names_of(files));
    if (list.times.keys.empty()) {
      require_one_pattern(files);
      require_no_mixed_times(files);
    }
  } catch (const std::invalid_argument& error) {
    fail(folder, error.what());
  }
  auto& [stamps_ns, keys, doubt] = list.times;
  std::vector<std::size_t> order(files.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto& sorted_by = keys;
  if (!keys.empty()) {
    std::ranges::stable_sort(order,
                             [&](std::size_t a, std::size_t b) { return sorted_by[a] < sorted_by[b]; });
  }
  for (const std::size_t i : order) list.files.push_back(files[i]);
  std::ranges::sort(keys);
  std::ranges::sort(stamps_ns);
  return list;
}

/// Throws if two images of a camera have the same stamp.
void require_different_stamps(const ImageList& images) {
  const auto& stamps_ns = images.times.stamps_ns;
  const auto repeated = std::ranges::adjacent_find(stamps_ns);
  if (repeated == stamps_ns.end()) return;
  fail(images.files[static_cast<std::size_t>(repeated - stamps_ns.begin())],
       "has the same stamp as the image after it");
}

/// Fills the frames with the images whose stamps are nearest.
void pair_by_stamps(const ImageList& left, const ImageList& right, const PairingOptions& options,
                    SequenceScan& scan) {
  const CameraStamps of_left{left.files.front().parent_path().filename().string(), left.times.stamps_ns};
  const CameraStamps of_right{right.files.front().parent_path().filename().string(), right.times.stamps_ns};
  const StampPairs pairs = paired_by_stamps(of_left, of_right, options, scan);
  for (const auto& [i, j] : pairs.pairs)
    scan.sequence.frames.push_back({left.times.stamps_ns[i], left.files[i], right.files[j]});
  warn_of_lone_images(of_left, of_right, pairs, scan);
}

/// The stamps of frames are those of their left images.
void set_stamps_of_left(const ImageList& left, std::vector<StereoFiles>& frames) {
  if (left.times.stamps_ns.empty()) return;
  std::map<fs::path, std::int64_t> stamps_ns;
  for (std::size_t i = 0; i < left.files.size(); ++i) stamps_ns[left.files[i]] = left.times.stamps_ns[i];
  for (auto& frame : frames) frame.stamp_ns = stamps_ns.at(frame.left);
}

/// Throws if the numbers of the images begin again at 0 or 1 after 9999 or the like: in the order of their
/// numbers the end of the recording would come first.
void require_no_wrap(const fs::path& folder, const std::vector<fs::path>& files) {
  std::vector<std::uint64_t> numbers;
  for (const auto& file : files) {
    const auto number = NumberedName(file.stem().string()).number;
    if (!number) return;
    numbers.push_back(*number);
  }
  std::ranges::sort(numbers);
  const std::string most = std::to_string(numbers.back());
  const bool is_last = most.size() > 2 && most.find_first_not_of('9') == std::string::npos;
  if (!is_last || numbers.front() > 1) return;
  const auto is_gap = [&](std::uint64_t a, std::uint64_t b) { return b - a > numbers.size(); };
  const auto gap = std::ranges::adjacent_find(numbers, is_gap);
  if (gap == numbers.end()) return;
  fail(folder,
       "the numbers of the images begin again at {} after {}, so their order is not known; add {} to those "
       "up to {}",
       numbers.front(), most, numbers.back() + 1 - numbers.front(), *gap);
}

}  // namespace

ImageList list_images(const fs::path& folder) {
  if (!fs::is_directory(folder)) fail(folder, "no such folder; it must contain the images of one camera");
  std::vector<fs::path> images;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const bool hidden = entry.path().filename().string().starts_with('.');  // as macOS's ._000000.png
    if (hidden || !has_image_name(entry.path())) continue;
    const bool broken_link = entry.is_symlink() && !entry.exists();  // is an image that cannot be read
    if (broken_link || entry.is_regular_file()) images.push_back(entry.path());
  }
  if (images.empty()) {
    const std::string names = names_in(folder);
    fail(folder, "contains no images (png, jpg, pgm, bmp, tif){}", names.empty() ? "" : "; it has " + names);
  }
  ImageList list = in_order(folder, std::move(images));
  if (list.times.keys.empty() && list.times.stamps_ns.empty()) require_no_wrap(folder, list.files);
  require_different_stamps(list);
  return list;
}

void pair_images(const ImageList& left_images, const ImageList& right_images, const PairingOptions& options,
                 SequenceScan& scan) {
  const auto& left = left_images.files;
  const auto& right = right_images.files;
  auto& frames = scan.sequence.frames;
  const auto right_by_name = by_name(right);
  (void)by_name(left);
  if (!left_images.times.stamps_ns.empty() && !right_images.times.stamps_ns.empty())
    return pair_by_stamps(left_images, right_images, options, scan);
  for (const auto& image : left) {
    const auto partner = right_by_name.find(image.stem().string());
    if (partner != right_by_name.end()) frames.push_back({0, image, partner->second});
  }
  if (frames.empty()) pair_by_number(left, right, frames);
  if (frames.empty() && left.size() == right.size()) pair_by_order(left, right, scan);
  set_stamps_of_left(left_images, frames);
  if (!frames.empty()) {
    const std::size_t alone = left.size() + right.size() - 2 * frames.size();
    if (alone > 0) {
      scan.warn(scan.sequence.folder,
                "{} no partner of the same name or number in the other folder and {} left out",
                counted(alone, "image has", "images have"), alone == 1 ? "is" : "are");
    }
    return;
  }
  fail(left.front().parent_path(),
       "holds {} and {} holds {}, without a name in common; give the images of a pair one name",
       counted(left.size(), "image"), right.front().parent_path().string(), right.size());
}

}  // namespace stereo_slam
