// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/image_folders.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/dataset/image_file.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

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

/// An image's name as text and the number at its end, frame_0012 as "frame_" and 12; no number for names
/// without one and for stamps.
struct NumberedName {
  std::string text;
  std::optional<std::uint64_t> number;

  explicit NumberedName(const fs::path& image) : text(image.stem().string()) {
    constexpr std::size_t kMostDigits = 12;
    const auto last_letter = text.find_last_not_of("0123456789");
    const std::string digits = text.substr(last_letter == std::string::npos ? 0 : last_letter + 1);
    if (digits.empty() || digits.size() > kMostDigits) return;
    number = std::stoull(digits);
    text.resize(text.size() - digits.size());
  }
};

/// Positions by the numbers in the names; nothing if these are no numbers of frames.
std::optional<FramePositions> by_number(const std::vector<StereoFiles>& frames,
                                        const std::vector<fs::path>& images) {
  std::set<std::string> names;
  std::set<std::string> texts;
  std::set<std::uint64_t> numbers;
  for (const auto& image : images) {
    const NumberedName name(image);
    if (!name.number) return std::nullopt;
    names.insert(image.stem().string());
    texts.insert(name.text);
    numbers.insert(*name.number);
  }
  if (texts.size() != 1 || numbers.size() != names.size()) return std::nullopt;
  const std::uint64_t first = *numbers.begin();
  // Every n-th image of a recording has numbers that differ by multiples of n.
  std::uint64_t step = 0;
  for (const auto number : numbers) step = std::gcd(step, number - first);
  constexpr std::uint64_t kMostGaps = 10;  // times the images; beyond it the names are no numbers of frames
  if (step == 0 || (*numbers.rbegin() - first) / step >= kMostGaps * numbers.size()) return std::nullopt;

  FramePositions result;
  for (const auto& frame : frames) {
    const auto number = NumberedName(frame.left).number.value();
    result.of_frame.push_back(static_cast<std::size_t>((number - first) / step));
  }
  result.count = static_cast<std::size_t>((*numbers.rbegin() - first) / step) + 1;
  result.missing = result.count - numbers.size();
  return result;
}

/// Positions in the natural order of the names.
FramePositions by_order(const std::vector<StereoFiles>& frames, const std::vector<fs::path>& images) {
  std::vector<std::string> names;
  names.reserve(images.size());
  for (const auto& image : images) names.push_back(image.stem().string());
  std::sort(names.begin(), names.end(), natural_less);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  FramePositions result;
  for (const auto& frame : frames) {
    const auto at = std::lower_bound(names.begin(), names.end(), frame.left.stem().string(), natural_less);
    result.of_frame.push_back(static_cast<std::size_t>(at - names.begin()));
  }
  result.count = names.size();
  return result;
}

}  // namespace

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
          {Problem::Severity::kWarning,
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

FramePositions FramePositions::without_gaps(std::size_t count) {
  FramePositions result{.of_frame = std::vector<std::size_t>(count), .count = count};
  std::iota(result.of_frame.begin(), result.of_frame.end(), std::size_t{0});
  return result;
}

FramePositions positions_of(const std::vector<StereoFiles>& frames, const std::vector<fs::path>& images) {
  auto numbered = by_number(frames, images);
  return numbered ? std::move(*numbered) : by_order(frames, images);
}

}  // namespace stereo_slam
