// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/shifted_pairs.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/support/rendered_drive.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

simulator::SimulationSettings short_drive() {
  simulator::SimulationSettings settings;
  settings.frames = 12;
  settings.samples_per_pixel = 4;
  settings.texture_size_px = 256;
  settings.camera = {496, 150, 287.5, 287.5, 242.9, 74.1};
  return settings;
}

SequenceScan scan_of(const StereoSequence& sequence) { return {.sequence = sequence, .problems = {}}; }

std::vector<Problem> problems_with(const StereoSequence& sequence) {
  std::vector<StereoFrame> frames;
  for (const std::size_t i : spread(sequence.frames.size(), 3)) frames.push_back(load_frame(sequence, i));
  return problems_of(check_stereo_agreement(frames), sequence, frames);
}

/// A source of frames whose images have one grey level each: the frame's number in the left one, and 100 more
/// in the right one. Keeps the numbers of the frames that were read.
struct NumberedSource final : PairSource {
  std::size_t frames = 0;
  std::vector<std::size_t> read_frames;

  explicit NumberedSource(std::size_t count) : frames(count) {}
  std::optional<RawPair> read(std::size_t index) override {
    read_frames.push_back(index);
    if (index >= frames) return std::nullopt;
    const auto grey = [&](std::size_t level) { return cv::Mat(40, 60, CV_8UC1, cv::Scalar(double(level))); };
    return RawPair{.left = grey(index), .right = grey(100 + index)};
  }
};

}  // namespace

TEST_CASE("Pairs that are shifted for certain are an error that names partners, unless the user says so",
          "[shift]") {
  const RenderedDrive drive(short_drive());
  SequenceScan shifted = scan_of(drive.sequence);
  offset_right_images(shifted, -2);
  shifted.sequence.pairs_as_told = false;
  const auto problems = problems_with(shifted.sequence);
  REQUIRE(problems.size() == 1);
  CHECK(is_error(problems[0]));
  CHECK_THAT(problems[0].text, Catch::Contains("look 2 frames late") && Catch::Contains("belongs to") &&
                                   Catch::Contains(".png of image_1") &&
                                   Catch::Contains("--right-image-offset 2 pairs all images so"));
  offset_right_images(shifted, 0);
  const auto allowed = problems_with(shifted.sequence);
  REQUIRE(allowed.size() == 1);
  CHECK_FALSE(is_error(allowed[0]));
  offset_right_images(shifted, 2);
  CHECK(problems_with(shifted.sequence).empty());
}

TEST_CASE("Pairs of another frame are certain, and neither good pairs nor displaced ones are", "[shift]") {
  const RenderedDrive drive(short_drive());
  const std::vector<std::size_t> indices = {4, 6, 8};
  for (const int late : {-2, -1, 1, 2}) CHECK_FALSE(are_shifted_pairs(drive.sequence, indices, late));
  SequenceScan shifted = scan_of(drive.sequence);
  offset_right_images(shifted, 1);
  CHECK(are_shifted_pairs(shifted.sequence, indices, -1));
  CHECK_FALSE(are_shifted_pairs(shifted.sequence, indices, 1));
  CHECK_FALSE(are_shifted_pairs(shifted.sequence, {4}, -1));     // one frame may seem so by chance
  CHECK_FALSE(are_shifted_pairs(shifted.sequence, {4, 6}, -7));  // there are no such images
  StereoSequence moved = drive.sequence;  // as of a rig that vibrates: by other rows in every frame
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < moved.frames.size(); ++i) {
    const cv::Mat image = cv::imread(moved.frames[i].right.string(), cv::IMREAD_GRAYSCALE);
    cv::Mat lower;
    const double rows = i % 2 == 0 ? 1.5 : -1.5;
    cv::warpAffine(image, lower, cv::Matx23d(1, 0, 0, 0, 1, rows), image.size(), cv::INTER_LINEAR,
                   cv::BORDER_REPLICATE);
    moved.frames[i].right = folder / frame_name(static_cast<int>(i));
    cv::imwrite(moved.frames[i].right.string(), lower);
  }
  for (const int late : {-2, -1, 1, 2}) CHECK_FALSE(are_shifted_pairs(moved, indices, late));
}

TEST_CASE("An offset pairs the files of other frames, and leaves out those without a partner", "[shift]") {
  StereoSequence sequence;
  for (int i = 0; i < 5; ++i) {
    const auto name = std::to_string(i);
    sequence.frames.push_back({.stamp_ns = i, .left = "l" + name, .right = "r" + name});
  }
  SequenceScan late = scan_of(sequence);
  offset_right_images(late, 2);
  REQUIRE(late.sequence.frames.size() == 3);
  CHECK(late.sequence.frames[0].left == "l0");
  CHECK(late.sequence.frames[0].right == "r2");
  CHECK(late.sequence.frames[2].right == "r4");
  CHECK(late.sequence.pairs_as_told);
  SequenceScan early = scan_of(sequence);
  offset_right_images(early, -3);
  REQUIRE(early.sequence.frames.size() == 2);
  CHECK(early.sequence.frames[0].stamp_ns == 3);
  CHECK(early.sequence.frames[0].left == "l3");
  CHECK(early.sequence.frames[0].right == "r0");
  SequenceScan none = scan_of(sequence);
  offset_right_images(none, 4);
  REQUIRE(none.problems.size() == 1);
  CHECK(is_error(none.problems[0]));
  CHECK_THAT(none.problems[0].text, Catch::Contains("of 5 frames fewer than two are left"));
  SequenceScan live = scan_of({});
  live.sequence.live = true;
  offset_right_images(live, 1);
  CHECK_THAT(live.problems.at(0).text, Catch::Contains("a live camera has no earlier images"));
}

TEST_CASE("An offset of images in a video reads every frame once, in order", "[shift]") {
  for (const int offset : {2, -2}) {
    CAPTURE(offset);
    StereoSequence sequence;
    auto source = std::make_shared<NumberedSource>(6);
    sequence.source = source;
    sequence.camera.width_px = 60;
    sequence.camera.height_px = 40;
    sequence.frames.resize(6);
    SequenceScan scan = scan_of(sequence);
    offset_right_images(scan, offset);
    REQUIRE(scan.sequence.frames.size() == 4);
    for (std::size_t i = 0; i < 4; ++i) {
      const StereoFrame frame = load_frame(scan.sequence, i);
      CHECK(std::size_t{frame.left.at<std::uint8_t>(0, 0)} == i + (offset > 0 ? 0U : 2U));
      CHECK(std::size_t{frame.right.at<std::uint8_t>(0, 0)} == 100 + i + (offset > 0 ? 2U : 0U));
    }
    CHECK(source->read_frames == std::vector<std::size_t>{0, 1, 2, 3, 4, 5});
    CHECK_FALSE(scan.sequence.source->read(4));
  }
}

TEST_CASE("An offset of images side by side takes the halves of two files", "[shift]") {
  const TemporaryFolder folder;
  StereoSequence sequence;
  sequence.side_by_side = true;
  sequence.camera.width_px = 60;
  sequence.camera.height_px = 40;
  for (int i = 0; i < 4; ++i) {
    cv::Mat both(40, 120, CV_8UC1, cv::Scalar(10.0 * i));
    both.colRange(60, 120) = 100.0 + 10.0 * i;
    const fs::path file = folder / frame_name(i);
    cv::imwrite(file.string(), both);
    sequence.frames.push_back({.stamp_ns = i, .left = file, .right = {}});
  }
  for (const bool right_first : {false, true}) {
    SequenceScan scan = scan_of(sequence);
    scan.sequence.right_half_first = right_first;
    offset_right_images(scan, 1);
    const StereoFrame frame = load_frame(scan.sequence, 1);
    const int left = frame.left.at<std::uint8_t>(0, 0), right = frame.right.at<std::uint8_t>(0, 0);
    CHECK(left == (right_first ? 110 : 10));
    CHECK(right == (right_first ? 20 : 120));
  }
}

TEST_CASE("An image that was lost on the way is named by the frame from which on pairs are shifted",
          "[shift]") {
  const RenderedDrive drive(short_drive());
  StereoSequence lost = drive.sequence;
  for (std::size_t i = 2; i + 1 < lost.frames.size(); ++i)
    lost.frames[i].right = drive.sequence.frames[i + 1].right;
  lost.frames.pop_back();
  CHECK(first_shifted_frame(lost, 8, -1) == 2);
  CHECK_THAT(text_of_partners(lost, 8, -1),
             Catch::Contains("; 000008.png of image_0 belongs to 000008.png") &&
                 Catch::Contains("from about 000002.png of image_0 on"));
  SequenceScan all = scan_of(drive.sequence);
  offset_right_images(all, 1);
  CHECK(first_shifted_frame(all.sequence, 8, -1) == 1);  // the first one that has a partner
}

TEST_CASE("Left images that are repeated are named, and no delay", "[shift]") {
  const RenderedDrive drive(short_drive());
  CHECK_FALSE(repeated_images(drive.sequence));
  StereoSequence repeated = drive.sequence;
  for (std::size_t i = 1; i < repeated.frames.size(); i += 2)
    repeated.frames[i].left = repeated.frames[i - 1].left;
  const auto problem = repeated_images(repeated);
  REQUIRE(problem);
  CHECK_THAT(problem->text, Catch::Contains("the image of image_0 is that of the frame before"));
  std::vector<StereoFrame> frames;
  for (const std::size_t i : {1U, 5U, 9U}) frames.push_back(load_frame(repeated, i));
  const auto found = findings_of(check_stereo_agreement(frames), repeated, frames);
  REQUIRE(found.problems.size() == 1);
  CHECK(found.problems[0].text == problem->text);
  CHECK_FALSE(found.right_delay);
  StereoSequence standing = drive.sequence;  // both cameras repeat an image, as without motion
  for (auto& frame : standing.frames) frame = standing.frames[0];
  CHECK_FALSE(repeated_images(standing));
}
