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

Positions Positions::without_gaps(std::size_t count) {
  Positions result{.of_frame = std::vector<std::size_t>(count), .count = count};
  std::iota(result.of_frame.begin(), result.of_frame.end(), std::size_t{0});
  return result;
}

Positions positions_of(const std::vector<StereoFiles>& frames, const std::vector<fs::path>& images) {
  std::set<std::uint64_t> numbers;
  std::set<std::string> texts;
  std::set<std::string> names;
  for (const auto& image : images) {
    const NumberedName name(image);
    names.insert(image.stem().string());
    texts.insert(name.text);
    if (name.number) numbers.insert(*name.number);
  }
  // Every n-th image of a recording has numbers that differ by multiples of n.
  std::uint64_t step = 0;
  for (const auto number : numbers) step = std::gcd(step, number - *numbers.begin());
  Positions result;
  constexpr std::uint64_t kMostGaps = 10;  // times the images; beyond it the names are no frame numbers
  const bool numbered = step > 0 && texts.size() == 1 && numbers.size() == names.size() &&
                        (*numbers.rbegin() - *numbers.begin()) / step < kMostGaps * names.size();
  if (!numbered) {
    std::vector<std::string> in_order(names.begin(), names.end());
    std::sort(in_order.begin(), in_order.end(), natural_less);
    for (const auto& frame : frames) {
      const auto at =
          std::lower_bound(in_order.begin(), in_order.end(), frame.left.stem().string(), natural_less);
      result.of_frame.push_back(static_cast<std::size_t>(at - in_order.begin()));
    }
    result.count = in_order.size();
    return result;
  }
  for (const auto& frame : frames) {
    const auto number = NumberedName(frame.left).number.value();
    result.of_frame.push_back(static_cast<std::size_t>((number - *numbers.begin()) / step));
  }
  result.count = static_cast<std::size_t>((*numbers.rbegin() - *numbers.begin()) / step) + 1;
  result.missing = result.count - numbers.size();
  return result;
}

}  // namespace stereo_slam
