// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/shifted_pairs.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/dataset/stereo_agreement.hpp"
#include "stereo_slam/io/counted.hpp"

namespace stereo_slam {
namespace {

/// By how much the rows of two images differ, px (median), besides a displacement and a roll of the right
/// camera. Nothing if hardly anything matches, or there is no such image.
std::optional<double> rest_of_rows_px(const StereoSequence& sequence, std::size_t left, std::size_t right) {
  constexpr double kLeastScale_px = 0.1;
  std::optional<double> rest_px;
  std::vector<Problem> ignored;  // unreadable images are reported elsewhere
  attempt(ignored, Problem::Severity::kWarning, [&] {
    RawPair pair = load_raw_pair(sequence, left, right);
    if (sequence.rectifier) {
      pair.left = sequence.rectifier->left(pair.left);
      pair.right = sequence.rectifier->right(pair.right);
    }
    const auto pairs = match_corners(pair.left, pair.right);
    if (pairs.size() >= StereoAgreement::kEnoughMatches)
      rest_px = line_of_rows(pairs, kLeastScale_px).median_residual;
  });
  return rest_px;
}

std::size_t first_with_partner(int late) { return late < 0 ? static_cast<std::size_t>(-late) : 0; }

/// Whether a pair agrees better with the shift than without it. Nothing if that is not seen, as where the
/// camera stands.
std::optional<bool> is_better_shifted(const StereoSequence& sequence, std::size_t left, int late) {
  constexpr double kMuchBetter = 0.5;
  const auto now_px = rest_of_rows_px(sequence, left, left);
  const auto right = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(left) + late);
  const auto shifted_px = rest_of_rows_px(sequence, left, right);
  if (now_px && (!shifted_px || *shifted_px > *now_px)) return false;
  if (shifted_px && (!now_px || *shifted_px < kMuchBetter * *now_px)) return true;
  return std::nullopt;
}

/// Pairs of a source that are made of a left image and the right image some frames later. The images between
/// them are kept, so that a video is read in order.
class OffsetPairs final : public PairSource {
 public:
  OffsetPairs(std::shared_ptr<PairSource> source, int offset)
      : source_(std::move(source)),
        left_(static_cast<std::size_t>(std::max(0, -offset))),
        right_(static_cast<std::size_t>(std::max(0, offset))) {}

  [[nodiscard]] std::optional<RawPair> read(std::size_t index) override {
    const std::size_t last = index + std::max(left_, right_);
    kept_.erase(kept_.begin(), kept_.lower_bound(index));
    kept_.erase(kept_.upper_bound(last), kept_.end());
    for (std::size_t i = index; i <= last; ++i) {
      if (kept_.contains(i)) continue;
      auto images = source_->read(i);
      if (!images) return std::nullopt;
      kept_.emplace(i, std::move(*images));
    }
    RawPair pair = kept_.at(index + left_);
    const RawPair& other = kept_.at(index + right_);
    pair.right = other.right;
    pair.right_fault = other.right_fault;
    return pair;
  }

  [[nodiscard]] bool add_values(std::size_t index, ValueCounts& values) override {
    return source_->add_values(index + left_, values);
  }
  void use_scale(const GreyScale& scale) override { source_->use_scale(scale); }
  [[nodiscard]] std::string warning() override { return source_->warning(); }

 private:
  std::shared_ptr<PairSource> source_;
  std::size_t left_;  // by how much the images of a pair lie behind its index
  std::size_t right_;
  std::map<std::size_t, RawPair> kept_;
};

}  // namespace

bool is_one_image(const StereoSequence& sequence) {
  return sequence.side_by_side || sequence.left_name == sequence.right_name;
}

std::string text_of_delay(const StereoSequence& sequence, int frames) {
  const auto count = static_cast<std::size_t>(std::abs(frames));
  std::string cause =
      fmt::format("the images of {} look {} {}; those of a pair must have been taken together",
                  is_one_image(sequence) ? "the right camera" : sequence.right_name, counted(count, "frame"),
                  frames > 0 ? "late" : "early");
  const bool same_names =
      !sequence.frames.empty() && sequence.frames.front().left.stem() == sequence.frames.front().right.stem();
  if (!is_one_image(sequence) && same_names) {
    cause += fmt::format(", so correct the names or the stamps of {} by {}", sequence.right_name,
                         counted(count, "frame"));
  } else if (!is_one_image(sequence)) {
    cause += fmt::format(", so remove the first {} of {}, or correct the stamps",
                         count == 1 ? "image" : counted(count, "image"),
                         frames > 0 ? sequence.right_name : sequence.left_name);
  }
  return cause;
}

std::string text_of_partners(const StereoSequence& sequence, std::size_t left, int late) {
  const auto right = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(left) + late);
  const auto name = [&](std::size_t frame, bool is_left) {
    const StereoFiles& files = sequence.frames[frame];
    const auto& file = is_left || sequence.side_by_side ? files.left : files.right;
    return sequence.source ? fmt::format("frame {}", frame) : file.filename().string();
  };
  const std::string left_name = is_one_image(sequence) ? "the left camera" : sequence.left_name;
  const std::string partners =
      fmt::format("; {} of {} belongs to {} of {}", name(left, true), left_name, name(right, false),
                  is_one_image(sequence) ? "the right camera" : sequence.right_name);
  const std::size_t first = first_shifted_frame(sequence, left, late);
  if (first > first_with_partner(late)) {
    return partners + fmt::format(
                          ", and so do those from about {} of {} on, where an image was lost; with "
                          "--right-image-offset 0 they are taken as they are",
                          name(first, true), left_name);
  }
  return partners + fmt::format(
                        ": --right-image-offset {} pairs all images so, and with "
                        "--right-image-offset 0 they are taken as they are",
                        late);
}

std::optional<Problem> repeated_images(const StereoSequence& sequence) {
  constexpr std::size_t kSampled = 24;
  constexpr std::size_t kMany = 6;  // one of so many; fewer hardly look like a delay
  constexpr std::size_t kLeast = 3;
  const auto is_same = [](const cv::Mat& a, const cv::Mat& b) {
    return a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0.0;
  };
  if (sequence.live || sequence.frames.size() < 2) return std::nullopt;
  std::size_t left = 0, right = 0, all = 0;
  std::vector<Problem> ignored;  // unreadable images are reported elsewhere
  const std::size_t starts = sequence.frames.size() - 1;
  for (const std::size_t start : spread(sequence.source ? std::min(starts, kSampled) : starts, kSampled)) {
    const std::size_t i = std::min(start + all % 2, starts - 1);  // even ones and odd ones
    attempt(ignored, Problem::Severity::kWarning, [&] {
      const auto before = load_raw_pair(sequence, i, i), after = load_raw_pair(sequence, i + 1, i + 1);
      const bool left_same = is_same(before.left, after.left);
      const bool right_same = is_same(before.right, after.right);
      ++all;
      left += left_same && !right_same ? 1 : 0;
      right += right_same && !left_same ? 1 : 0;
    });
  }
  if (const auto most = std::max(left, right); most < kLeast || kMany * most < all) return std::nullopt;
  const auto& [name, other] = left > right ? std::pair(sequence.left_name, sequence.right_name)
                                           : std::pair(sequence.right_name, sequence.left_name);
  return Problem::warning(
      sequence.folder,
      "in {} of {} sampled frames the image of {} is that of the frame before, and that of {} is new: the "
      "camera delivers fewer images, or single ones were repeated, so that these pairs were not taken "
      "together; leave out these frames",
      std::max(left, right), all, name, other);
}

bool are_shifted_pairs(const StereoSequence& sequence, const std::vector<std::size_t>& indices, int late) {
  constexpr std::size_t kLeastFrames = 2;  // chance may let one seem so
  std::size_t better = 0;
  for (const std::size_t i : indices) {
    const auto is_better = is_better_shifted(sequence, i, late);
    if (is_better == false) return false;
    better += is_better ? 1 : 0;
  }
  return better >= kLeastFrames;
}

std::size_t first_shifted_frame(const StereoSequence& sequence, std::size_t known, int late) {
  std::size_t before = first_with_partner(late);  // not shifted, as long as it is not the result
  if (sequence.source || is_better_shifted(sequence, before, late) != false) return before;
  while (known - before > 1) {
    const std::size_t middle = before + (known - before) / 2;
    (is_better_shifted(sequence, middle, late) == false ? before : known) = middle;
  }
  return known;
}

void offset_right_images(SequenceScan& scan, int offset) {
  auto& sequence = scan.sequence;
  auto& frames = sequence.frames;
  sequence.pairs_as_told = true;
  if (offset == 0 || (frames.empty() && !sequence.live)) return;
  const auto count = static_cast<std::size_t>(std::abs(offset));
  if (sequence.live || frames.size() < count + 2) {
    scan.problems.push_back(
        Problem::error(sequence.folder, "--right-image-offset {}: {}", offset,
                       sequence.live ? "a live camera has no earlier images"
                                     : fmt::format("of {} frames fewer than two are left", frames.size())));
    return;
  }
  const auto all = frames;
  frames.erase(offset > 0 ? frames.end() - std::abs(offset) : frames.begin(),
               offset > 0 ? frames.end() : frames.begin() + std::abs(offset));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const StereoFiles& other = all[offset > 0 ? i + count : i];
    frames[i].right = sequence.side_by_side ? other.left : other.right;
  }
  if (sequence.source) sequence.source = std::make_shared<OffsetPairs>(sequence.source, offset);
}

}  // namespace stereo_slam
