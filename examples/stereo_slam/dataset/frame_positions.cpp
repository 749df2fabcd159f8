// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/frame_positions.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "stereo_slam/stamps/image_names.hpp"
#include "stereo_slam/stamps/stamp_units.hpp"

namespace stereo_slam {
namespace {

/// The images of lists by their names.
struct ListedImage {
  std::optional<std::int64_t> key;      ///< see NameTimes
  std::optional<std::uint64_t> number;  ///< of the frame
};
using ListedImages = std::map<std::string, ListedImage>;

ListedImages listed(const ImageList& left, const ImageList& right) {
  ListedImages images;
  for (const auto* list : {&left, &right}) {
    for (std::size_t i = 0; i < list->files.size(); ++i) {
      ListedImage& image = images[list->files[i].stem().string()];
      if (!list->times.keys.empty()) image.key = list->times.keys[i];
    }
  }
  return images;
}

/// Sets the numbers of frames: unknown times, or the numbers at the end of the names, if these differ in them
/// only. False if the names are no numbers.
bool set_numbers(ListedImages& images) {
  std::set<std::string> texts;
  std::set<std::uint64_t> numbers;
  for (auto& [text, image] : images) {
    const NumberedName name(text);
    image.number = image.key ? std::optional(static_cast<std::uint64_t>(*image.key)) : name.number;
    if (!image.number) return false;
    if (!image.key) texts.insert(name.text);
    numbers.insert(*image.number);
  }
  return texts.size() <= 1 && numbers.size() == images.size();
}

/// Positions by the numbers in the names; nothing if these are no numbers of frames.
std::optional<FramePositions> by_number(const std::vector<StereoFiles>& frames, ListedImages images) {
  if (!set_numbers(images)) return std::nullopt;
  std::set<std::uint64_t> numbers;
  for (const auto& [name, image] : images) numbers.insert(*image.number);
  const std::uint64_t first = *numbers.begin();
  // Every n-th image of a recording has numbers that differ by multiples of n.
  std::uint64_t step = 0;
  for (const auto number : numbers) step = std::gcd(step, number - first);
  constexpr std::uint64_t kMostGaps = 10;  // times the images; beyond it the names are no numbers of frames
  if (step == 0 || (*numbers.rbegin() - first) / step >= kMostGaps * numbers.size()) return std::nullopt;

  FramePositions result;
  for (const auto& frame : frames) {
    const auto number = images.at(frame.left.stem().string()).number.value();
    result.of_frame.push_back(static_cast<std::size_t>((number - first) / step));
  }
  result.count = static_cast<std::size_t>((*numbers.rbegin() - first) / step) + 1;
  result.missing = result.count - numbers.size();
  return result;
}

/// Positions in the order of the images.
FramePositions by_order(const std::vector<StereoFiles>& frames, const ListedImages& images) {
  std::vector<std::string> names;
  for (const auto& [name, image] : images) names.push_back(name);
  std::ranges::sort(names, [&](const auto& a, const auto& b) {
    const auto key_a = images.at(a).key;
    const auto key_b = images.at(b).key;
    return key_a && key_b && *key_a != *key_b ? *key_a < *key_b : natural_less(a, b);
  });
  std::map<std::string, std::size_t> positions;
  for (std::size_t i = 0; i < names.size(); ++i) positions[names[i]] = i;
  FramePositions result{.of_frame = {}, .count = names.size()};
  for (const auto& frame : frames) result.of_frame.push_back(positions.at(frame.left.stem().string()));
  return result;
}

/// The positions of frames by times in a unit that is not known, counted in usual intervals.
std::optional<FramePositions> by_interval(const std::vector<StereoFiles>& frames, const ListedImages& images,
                                          std::int64_t interval) {
  if (interval <= 0) return std::nullopt;  // of a single image
  std::set<std::int64_t> positions;
  const auto first = std::ranges::min_element(images, [](const auto& a, const auto& b) {
                       return a.second.key < b.second.key;
                     })->second.key.value();
  const auto position_of = [&](const ListedImage& image) {
    return std::llround(static_cast<double>(image.key.value() - first) / static_cast<double>(interval));
  };
  for (const auto& [name, image] : images) positions.insert(position_of(image));
  if (positions.size() != images.size()) return std::nullopt;
  FramePositions result;
  for (const auto& frame : frames)
    result.of_frame.push_back(static_cast<std::size_t>(position_of(images.at(frame.left.stem().string()))));
  result.count = static_cast<std::size_t>(*positions.rbegin()) + 1;
  result.missing = result.count - positions.size();
  return result;
}

}  // namespace

FramePositions FramePositions::without_gaps(std::size_t count) {
  FramePositions result{.of_frame = std::vector<std::size_t>(count), .count = count};
  std::iota(result.of_frame.begin(), result.of_frame.end(), std::size_t{0});
  return result;
}

FramePositions positions_of(const std::vector<StereoFiles>& frames, const ImageList& left,
                            const ImageList& right) {
  const ListedImages images = listed(left, right);
  std::optional<FramePositions> counted;
  if (!left.times.doubt.empty()) {
    counted = by_interval(frames, images, usual_interval_ns(left.times.keys));
  } else if (left.times.stamps_ns.empty()) {
    counted = by_number(frames, images);
  }
  return counted ? std::move(*counted) : by_order(frames, images);
}

}  // namespace stereo_slam
