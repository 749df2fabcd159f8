// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/message_times.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <numeric>
#include <stdexcept>

#include <fmt/format.h>

#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

/// The longest part of these messages whose stamps increase.
std::vector<std::size_t> longest_in_order(const std::vector<MessageTime>& times,
                                          const std::vector<std::size_t>& messages) {
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> ends;  // the last message, with the earliest stamp, of a part of each length
  std::vector<std::size_t> before(times.size(), kNone);
  for (const std::size_t i : messages) {
    const auto longer = std::ranges::lower_bound(ends, times[i].header_ns, {},
                                                 [&](std::size_t end) { return times[end].header_ns; });
    if (longer != ends.begin()) before[i] = *(longer - 1);
    if (longer == ends.end()) {
      ends.push_back(i);
    } else {
      *longer = i;
    }
  }
  std::vector<std::size_t> part;
  for (std::size_t i = ends.empty() ? kNone : ends.back(); i != kNone; i = before[i]) part.push_back(i);
  std::ranges::reverse(part);
  return part;
}

/// Whether the stamps of two messages are far from each other, though these were recorded together.
bool are_far_apart(const MessageTime& a, const MessageTime& b) {
  constexpr std::int64_t kFar_ns = 10'000'000'000;
  return std::abs(a.header_ns - b.header_ns) - std::abs(a.record_ns - b.record_ns) > kFar_ns;
}

/// How many messages may be out of order.
std::size_t most_out_of_order(const std::vector<MessageTime>& times) {
  constexpr std::size_t kOneOf = 100;
  return std::max<std::size_t>(1, times.size() / kOneOf);
}

/// Removes the first and the last messages whose stamps are far from the others, though in order: zeros at
/// the beginning, for example.
void remove_far_ends(const std::vector<MessageTime>& times, std::vector<std::size_t>& kept) {
  const std::size_t most = most_out_of_order(times);
  for (int end = 0; end < 2; ++end) {
    for (std::size_t i = std::min(most, kept.size() / 2); i > 0; --i) {
      if (!are_far_apart(times[kept[i - 1]], times[kept[i]])) continue;
      kept.erase(kept.begin(), kept.begin() + static_cast<std::ptrdiff_t>(i));
      break;
    }
    std::ranges::reverse(kept);
  }
}

void require_stamps(const std::vector<MessageTime>& times) {
  const auto zeros = static_cast<std::size_t>(
      std::ranges::count_if(times, [](const auto& time) { return time.header_ns == 0; }));
  if (zeros < 2 || 2 * zeros < times.size()) return;
  throw std::invalid_argument(
      fmt::format("{} of its {} images have the stamp zero in their headers; the option --record-times uses "
                  "the times at which they were recorded, or correct the driver and record again",
                  zeros, times.size()));
}

void require_order(const std::vector<MessageTime>& times, std::size_t out_of_order) {
  if (out_of_order <= most_out_of_order(times)) return;
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i].header_ns >= times[i - 1].header_ns) continue;
    throw std::invalid_argument(fmt::format(
        "{} of its {} images are out of order: the stamp of image {}, {} s, is earlier than that of the "
        "image before, {} s; write the bag again with stamps in order, or use --record-times",
        out_of_order, times.size(), i, format_seconds(times[i].header_ns),
        format_seconds(times[i - 1].header_ns)));
  }
}

}  // namespace

TimedImages by_header_stamps(const std::vector<MessageTime>& times) {
  require_stamps(times);
  TimedImages images;
  std::vector<std::size_t> different;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (i > 0 && times[i].header_ns == times[i - 1].header_ns) {
      ++images.repeated;
    } else {
      different.push_back(i);
    }
  }
  images.index = longest_in_order(times, different);
  remove_far_ends(times, images.index);
  require_order(times, different.size() - images.index.size());
  std::set_difference(different.begin(), different.end(), images.index.begin(), images.index.end(),
                      std::back_inserter(images.out_of_order));
  for (const std::size_t i : images.index) images.stamps_ns.push_back(times[i].header_ns);
  return images;
}

TimedImages by_record_times(const std::vector<MessageTime>& times) {
  std::vector<std::size_t> order(times.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(
      order, [&](std::size_t a, std::size_t b) { return times[a].record_ns < times[b].record_ns; });
  TimedImages images;
  for (const std::size_t i : order) {
    if (!images.stamps_ns.empty() && times[i].record_ns == images.stamps_ns.back()) {
      ++images.repeated;
      continue;
    }
    images.index.push_back(i);
    images.stamps_ns.push_back(times[i].record_ns);
  }
  return images;
}

}  // namespace stereo_slam
