// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/image_folders.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/dataset/image_file.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"

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

/// Whether a name is a time in seconds since 1970 with decimals, as Python's time.time() is written.
bool is_decimal_time(const std::string& name) {
  constexpr std::size_t kMinDigits = 9;  // since 1973
  constexpr const char* kDigits = "0123456789";
  const auto point = name.find('.');
  return point != std::string::npos && point >= kMinDigits && point + 1 < name.size() &&
         name.find_first_not_of(kDigits) == point &&
         name.find_first_not_of(kDigits, point + 1) == std::string::npos;
}

/// Order of decimal times: 5.25 before 5.5.
bool decimal_less(const std::string& a, const std::string& b) {
  const auto point_a = a.find('.');
  const auto point_b = b.find('.');
  return point_a != point_b ? point_a < point_b : a < b;
}

/// The order of these names, without extensions.
using NameOrder = bool (*)(const std::string&, const std::string&);
NameOrder order_of(const std::vector<std::string>& names) {
  return std::all_of(names.begin(), names.end(), is_decimal_time) ? decimal_less : natural_less;
}

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
  std::vector<std::string> names = names_of(images);
  const NameOrder less = order_of(names);
  std::sort(names.begin(), names.end(), less);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  FramePositions result;
  for (const auto& frame : frames) {
    const auto at = std::lower_bound(names.begin(), names.end(), frame.left.stem().string(), less);
    result.of_frame.push_back(static_cast<std::size_t>(at - names.begin()));
  }
  result.count = names.size();
  return result;
}

/// The images by the numbers of their frames; empty if their names are no text with such a number.
std::map<std::uint64_t, fs::path> by_frame_number(const std::vector<fs::path>& images) {
  std::map<std::uint64_t, fs::path> numbered;
  const std::string text = NumberedName(images.front()).text;
  for (const auto& image : images) {
    const NumberedName name(image);
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

/// Throws if the names are stamps and show that a pair was not taken at the same time.
void require_same_times(const std::vector<StereoFiles>& pairs) {
  constexpr double kMostOfInterval = 0.5;
  std::vector<std::int64_t> left_ns;
  std::vector<std::int64_t> right_ns;
  for (const auto& pair : pairs) {
    const auto left = stamp_in_name(pair.left);
    const auto right = stamp_in_name(pair.right);
    if (!left || !right) return;
    left_ns.push_back(*left);
    right_ns.push_back(*right);
  }
  std::int64_t interval_ns = std::numeric_limits<std::int64_t>::max();
  for (std::size_t i = 1; i < pairs.size(); ++i)
    interval_ns = std::min(interval_ns, left_ns[i] - left_ns[i - 1]);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto apart_ns = static_cast<double>(std::abs(left_ns[i] - right_ns[i]));
    if (apart_ns <= kMostOfInterval * static_cast<double>(interval_ns)) continue;
    fail(pairs[i].left,
         fmt::format(
             "would be a pair with {}, but their stamps are {:.3g} s apart; an image is missing before "
             "them, or each camera has a clock of its own; give the images of a pair one name",
             pairs[i].right.filename().string(), 1e-9 * apart_ns));
  }
}

/// Fills the frames with pairs in the order of the names. Warns if the names have numbers of frames, but none
/// is in both folders.
void pair_by_order(const std::vector<fs::path>& left, const std::vector<fs::path>& right,
                   SequenceScan& scan) {
  auto& frames = scan.sequence.frames;
  for (std::size_t i = 0; i < left.size(); ++i) frames.push_back({0, left[i], right[i]});
  require_same_times(frames);
  const auto left_numbered = by_frame_number(left);
  const auto right_numbered = by_frame_number(right);
  const bool numbered = !left_numbered.empty() && !right_numbered.empty();
  const auto in_both = [&](const auto& image) { return right_numbered.contains(image.first); };
  if (!numbered || std::any_of(left_numbered.begin(), left_numbered.end(), in_both)) return;
  scan.problems.push_back(
      {Problem::Severity::kWarning,
       fmt::format("{}: the images of the two cameras have no number in common, so they are paired by order, "
                   "{} with {}; check that these were taken together, and give the images of a pair one name",
                   scan.sequence.folder.string(), left.front().filename().string(),
                   right.front().filename().string())});
}

/// What is before the number at the end of an image's name; nothing without a number. A stamp is a number.
std::optional<std::string> text_before_number(const fs::path& image) {
  std::string name = image.stem().string();
  if (is_decimal_time(name)) return "";
  const auto last_letter = name.find_last_not_of("0123456789");
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
  const auto most = std::max_element(counts.begin(), counts.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == counts.end() || 2 * most->second <= images.size()) return;
  for (const auto& image : images) {
    const auto text = text_before_number(image);
    if (text && (*text == most->first || !most->first.empty())) continue;
    const std::string pattern = most->first.empty() ? "digits only" : "'" + most->first + "' and a number";
    fail(image, fmt::format("its name is not {}, as those of {} of the {} images are; remove it if it is a "
                            "copy or no image of the recording, or rename it",
                            pattern, most->second, images.size()));
  }
}

}  // namespace

std::optional<std::int64_t> stamp_in_name(const fs::path& image) {
  constexpr std::size_t kMinDigits = 13;
  const std::string name = image.stem().string();
  if (is_decimal_time(name)) return parse_seconds(name);
  const auto stamp_ns = parse_nanoseconds(name);
  return name.size() >= kMinDigits && stamp_ns && *stamp_ns >= 0 ? stamp_ns : std::nullopt;
}

std::vector<fs::path> list_images(const fs::path& folder) {
  if (!fs::is_directory(folder)) fail(folder, "no such folder; it must contain the images of one camera");
  std::vector<fs::path> images;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const bool hidden = entry.path().filename().string().starts_with('.');  // as macOS's ._000000.png
    if (hidden || !has_image_name(entry.path())) continue;
    if (entry.is_symlink() && !entry.exists()) {
      fail(entry.path(), "is a link to a file that does not exist; restore the file or remove the link");
    }
    if (entry.is_regular_file()) images.push_back(entry.path());
  }
  if (images.empty()) fail(folder, "contains no images (png, jpg, pgm, bmp, tif)");
  require_one_pattern(images);
  const NameOrder less = order_of(names_of(images));
  std::sort(images.begin(), images.end(), [&](const auto& a, const auto& b) {
    return a.stem() != b.stem() ? less(a.stem().string(), b.stem().string()) : a.extension() < b.extension();
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
  if (frames.empty()) pair_by_number(left, right, frames);
  if (!frames.empty()) {
    const std::size_t alone = left.size() + right.size() - 2 * frames.size();
    if (alone > 0) {
      scan.problems.push_back(
          {Problem::Severity::kWarning,
           fmt::format("{}: {} images have no partner of the same name or number in the other folder; they "
                       "are left out",
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
  pair_by_order(left, right, scan);
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
