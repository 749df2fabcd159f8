// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// Replaces the images below a folder by ones of another size.
void resize_images(const fs::path& folder, const cv::Size& size) {
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".png") continue;
    cv::Mat small;
    cv::resize(cv::imread(entry.path().string(), cv::IMREAD_GRAYSCALE), small, size, 0.0, 0.0,
               cv::INTER_AREA);
    cv::imwrite(entry.path().string(), small);
  }
}

SequenceScan scan_scaled(const fs::path& folder, double factor) {
  SequenceScan scan = scan_sequence(folder, "auto");
  scale_images(scan, factor);
  return scan;
}

void check_same_frames(const StereoSequence& a, const StereoSequence& b) {
  CHECK(a.camera.fx == Approx(b.camera.fx).epsilon(1e-12));
  CHECK(a.camera.fy == Approx(b.camera.fy).epsilon(1e-12));
  CHECK(a.camera.cx == Approx(b.camera.cx).epsilon(1e-12));
  CHECK(a.camera.cy == Approx(b.camera.cy).epsilon(1e-12));
  CHECK(a.camera.baseline_m == Approx(b.camera.baseline_m).epsilon(1e-12));
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    const StereoFrame of_a = load_frame(a, i);
    const StereoFrame of_b = load_frame(b, i);
    CHECK(of_a.left.size() == cv::Size(a.camera.width_px, a.camera.height_px));
    CHECK(cv::norm(of_a.left, of_b.left, cv::NORM_INF) == 0.0);
    CHECK(cv::norm(of_a.right, of_b.right, cv::NORM_INF) == 0.0);
  }
}

}  // namespace

TEST_CASE("A recording at scale .5 is that of images resized before, with a scaled calibration", "[scale]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "full", 3);
  fs::copy(folder / "full", folder / "half", fs::copy_options::recursive);
  resize_images(folder / "half", {TinySequence::kWidth / 2, TinySequence::kHeight / 2});
  // fx, fy, the baseline times fx, and the centre, from 160 and 60, in pixels half as large: (c + .5) / 2 -
  // .5.
  write_text(folder / "half/calib.txt",
             "P0: 100 0 79.75 0 0 100 29.75 0 0 0 1 0\nP1: 100 0 79.75 -40 0 100 29.75 0 0 0 1 0\n");
  const SequenceScan scan = scan_scaled(folder / "full", 0.5);
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.unscaled == cv::Size(TinySequence::kWidth, TinySequence::kHeight));
  check_same_frames(scan.sequence, open_sequence(folder / "half", "auto"));
}

TEST_CASE("Raw images are scaled before they are rectified, and so is their calibration", "[scale]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder / "full", 3);
  write_tiny_euroc(folder / "half", 3);
  resize_images(folder / "half", {TinySequence::kWidth / 2, TinySequence::kHeight / 2});
  for (const auto* camera : {"cam0", "cam1"}) {
    for (const auto* recording : {"full", "half"}) {
      const fs::path file = folder / recording / "mav0" / camera / "sensor.yaml";
      replace_in(file, "coefficients: [0, 0", "coefficients: [-0.2, 0.05");
      if (recording == std::string("full")) continue;
      replace_in(file, "[320, 120]", "[160, 60]");
      replace_in(file, "[200, 200, 160, 60]", "[100, 100, 79.75, 29.75]");
    }
  }
  const SequenceScan scan = scan_scaled(folder / "full", 0.5);
  CHECK(scan.problems.empty());
  check_same_frames(scan.sequence, open_sequence(folder / "half", "auto"));
}

TEST_CASE("A scale that does not divide the size keeps the calibration exact along both axes", "[scale]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), 2);
  const SequenceScan scan = scan_scaled(folder.path(), 0.37);  // 118.4 x 44.4 pixels
  const auto& camera = scan.sequence.camera;
  CHECK(camera.width_px == 118);
  CHECK(camera.height_px == 44);
  CHECK(camera.fx == Approx(200.0 * 118 / 320));
  CHECK(camera.fy == Approx(200.0 * 44 / 120));
  CHECK(camera.cx == Approx(160.5 * 118 / 320 - 0.5));
  CHECK(camera.baseline_m == Approx(TinySequence::kBaseline_m));
  CHECK(load_frame(scan.sequence, 1).right.size() == cv::Size(118, 44));
}

TEST_CASE("Both halves of an image with both cameras are scaled on their own", "[scale]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 2);
  fs::create_directory(folder / "both");
  for (int i = 0; i < 2; ++i) {
    cv::Mat both;
    cv::hconcat(cv::imread((folder / "left" / frame_name(i)).string(), cv::IMREAD_GRAYSCALE),
                cv::imread((folder / "right" / frame_name(i)).string(), cv::IMREAD_GRAYSCALE), both);
    cv::imwrite((folder / "both" / frame_name(i)).string(), both);
  }
  const StereoSequence separate = scan_scaled(folder.path(), 0.3).sequence;
  write_text(folder / "calibration.yaml",
             tiny_calibration("frame_rate_hz: 10\nlayout: side-by-side\nsource: both\n"));
  check_same_frames(scan_scaled(folder.path(), 0.3).sequence, separate);
}

TEST_CASE("A scale that leaves hardly a pixel is refused, and scale 1 changes nothing", "[scale]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), 2);
  const SequenceScan tiny = scan_scaled(folder.path(), 0.05);
  REQUIRE(tiny.problems.size() == 1);
  CHECK(is_error(tiny.problems[0]));
  CHECK_THAT(tiny.problems[0].text, Catch::Contains("--scale 0.05 makes images of 16x6 pixels"));
  CHECK(scan_scaled(folder.path(), 1.0).sequence.unscaled.empty());
}

TEST_CASE("An image of another size is named by its own size, also in a scaled recording", "[scale]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), 3);
  cv::imwrite((folder / "image_0/000001.png").string(), tiny_texture(160));
  const SequenceScan scan = scan_scaled(folder.path(), 0.5);
  CHECK_THAT(message_of([&] { (void)load_frame(scan.sequence, 1); }),
             Catch::Contains("000001.png: is 160x120 pixels where the sequence has 320x120"));
  const StereoFrame partial = load_partial_frame(scan.sequence, 1);
  CHECK(partial.left.size() == cv::Size(160, 60));
  CHECK_FALSE(partial.has_left());
}

TEST_CASE("Images that need more memory than the machine has are refused with the scale that fits",
          "[scale]") {
  SequenceScan scan;
  scan.sequence.folder = "big";
  scan.sequence.camera = {.fx = 1e5, .fy = 1e5, .cx = 1e5, .cy = 1e5, .baseline_m = 1.0};
  scan.sequence.camera.width_px = scan.sequence.camera.height_px = 4096;
  check_memory(scan);
  CHECK(scan.problems.empty());
  CHECK_FALSE(scan.too_large);
  scan.sequence.camera.width_px = scan.sequence.camera.height_px = 2'000'000;
  check_memory(scan);
  REQUIRE(scan.problems.size() == 1);
  CHECK(is_error(scan.problems[0]));
  CHECK_THAT(scan.problems[0].text, Catch::Contains("GB that it may use; scale them, as by --scale 0.0"));
  CHECK(scan.too_large);
}
