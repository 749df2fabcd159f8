// SPDX-License-Identifier: MIT
// Images with 16 bits a pixel: the grey scale that a recording gets.
#include <algorithm>
#include <cmath>
#include <functional>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/images/image_file.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("Of an image with 16 bits a pixel, the bits that are used decide the grey level", "[image]") {
  const TemporaryFolder folder;
  const cv::Mat image = tiny_texture(64);
  const fs::path file = folder / "a.png";
  for (const int bits : {8, 10, 12, 14, 16}) {
    CAPTURE(bits);
    cv::Mat wide;
    image.convertTo(wide, CV_16U, std::ldexp(1.0, bits - 8));
    for (const auto* name : {"a.png", "a.pgm", "a.tiff"}) {
      cv::imwrite((folder / name).string(), wide);
      ValueCounts values;
      values.add(load_16_bit_image(folder / name));
      CHECK(values.bits() == bits);
      CHECK(values.scale() == GreyScale::of_bits(bits));
      CHECK(cv::norm(load_gray_image(folder / name, values.scale()), image, cv::NORM_INF) == 0.0);
    }
  }
  cv::imwrite(file.string(), image);
  CHECK(load_16_bit_image(file).empty());
  CHECK(cv::norm(load_gray_image(file, GreyScale::of_bits(12)), image, cv::NORM_INF) == 0.0);
}

TEST_CASE("A recording of a camera with 12 bits is read with its contrast, and a warning", "[image]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "8", 3);
  fs::copy(folder / "8", folder / "12", fs::copy_options::recursive);
  for (const auto& entry : fs::recursive_directory_iterator(folder / "12")) {
    if (entry.path().extension() != ".png") continue;
    cv::Mat image = cv::imread(entry.path().string(), cv::IMREAD_GRAYSCALE);
    image.convertTo(image, CV_16U, 16.0);
    cv::imwrite(entry.path().string(), image);
  }
  const SequenceScan scan = scan_sequence(folder / "12", "auto");
  CHECK(scan.sequence.scale == GreyScale::of_bits(12));
  REQUIRE(scan.problems.size() == 1);
  CHECK_FALSE(is_error(scan.problems[0]));
  CHECK_THAT(
      scan.problems[0].text,
      Catch::Contains("no value is above 4095 in the 3 pairs examined; they are read as images of 12"));
  const auto narrow = load_frame(open_sequence(folder / "8", "auto"), 1);
  const auto wide = load_frame(scan.sequence, 1);
  CHECK(cv::norm(narrow.left, wide.left, cv::NORM_INF) == 0.0);
  CHECK(cv::norm(narrow.right, wide.right, cv::NORM_INF) == 0.0);
}

namespace {

/// The tiny recording in `folder`/16, its grey levels `step` values apart from `black` on; `change` has the
/// last word on each image, with the number of its frame.
SequenceScan scan_16_bit(
    const fs::path& folder, double black, double step,
    const std::function<void(cv::Mat&, int)>& change = [](cv::Mat&, int) {}) {
  fs::remove_all(folder / "16");
  write_tiny_sequence(folder / "16", 6);
  for (int i = 0; i < 6; ++i) {
    for (const auto* camera : {"image_0", "image_1"}) {
      const std::string file = folder / "16" / camera / frame_name(i);
      cv::Mat image = cv::imread(file, cv::IMREAD_GRAYSCALE);
      image.convertTo(image, CV_16U, step, black);
      change(image, i);
      cv::imwrite(file, image);
    }
  }
  return scan_sequence(folder / "16", "auto");
}

/// Exchanges the two bytes of each value, as where the order of the machine is written for that of the
/// format.
void exchange_bytes(cv::Mat& image, int /*frame*/) {
  image.forEach<std::uint16_t>([](std::uint16_t& value, const int*) {
    value = static_cast<std::uint16_t>((value << 8) | (value >> 8));
  });
}

/// The share of the pixels of an image with a grey level from `low` to `high`.
double share_between(const cv::Mat& image, int low, int high) {
  cv::Mat between;
  cv::inRange(image, low, high, between);
  return cv::countNonZero(between) / static_cast<double>(between.total());
}

}  // namespace

TEST_CASE("A thermal recording, which uses a small part of 16 bits, is read with contrast", "[image]") {
  const TemporaryFolder folder;
  const auto hot_pixel = [](cv::Mat& image, int frame) {
    if (frame == 2) image.at<std::uint16_t>(60, 100) = 65535;
  };
  const auto metadata = [](cv::Mat& image, int frame) {
    for (int x = 0; x < 64; ++x) image.at<std::uint16_t>(0, x) = x % 2 == 0 ? 65535 : 0;
    image.at<std::uint16_t>(0, 0) = static_cast<std::uint16_t>(frame);
  };
  const auto cold_sky = [](cv::Mat& image, int) { image.rowRange(0, 1) = 0; };
  const std::vector<std::function<void(cv::Mat&, int)>> changes = {[](cv::Mat&, int) {}, hot_pixel, metadata,
                                                                   cold_sky};
  for (std::size_t k = 0; k < changes.size(); ++k) {
    CAPTURE(k);
    const SequenceScan scan = scan_16_bit(folder.path(), 7000.0, 900.0 / 255.0, changes[k]);
    REQUIRE(scan.problems.size() == 1);
    CHECK_FALSE(is_error(scan.problems[0]));
    CHECK_THAT(scan.problems[0].text,
               Catch::Contains("98 % of the values in the 6 pairs examined are from 7") &&
                   Catch::Contains("in all frames"));
    for (const std::size_t i : {0U, 2U, 5U}) {
      const StereoFrame frame = load_frame(scan.sequence, i);
      CHECK(share_between(frame.left, 60, 196) > 0.95);
      CHECK(share_between(frame.left, 1, 254) > 0.98);
      CHECK(check_stereo_agreement({frame}).matches >= StereoAgreement::kEnoughMatches);
    }
  }
}

TEST_CASE("The scale of grey levels is the same for all frames, and follows no single one", "[image]") {
  const TemporaryFolder folder;
  const SequenceScan scan = scan_16_bit(folder.path(), 7000.0, 2.0, [](cv::Mat& image, int frame) {
    image += frame == 3 ? 100 : 0;  // a warmer scene is brighter
  });
  const double before = cv::mean(load_frame(scan.sequence, 2).left)[0];
  const double warm = cv::mean(load_frame(scan.sequence, 3).left)[0];
  CHECK(warm - before == Approx(100.0 / scan.sequence.scale.step).margin(1.0));
}

TEST_CASE("Thermal images whose values drift, or differ between the cameras, keep their contrast",
          "[image]") {
  const TemporaryFolder folder;
  const SequenceScan still = scan_16_bit(folder / "still", 21000.0, 900.0 / 255.0);
  CHECK_FALSE(still.sequence.scale.by_median);
  const SequenceScan drifting = scan_16_bit(folder / "drifting", 21000.0, 900.0 / 255.0,
                                            [](cv::Mat& image, int i) { image += 700 * i; });
  int images = 0;  // left and right ones in turn
  const SequenceScan unlike =
      scan_16_bit(folder / "unlike", 21000.0, 900.0 / 255.0,
                  [&](cv::Mat& image, int) { image += images++ % 2 == 0 ? 0 : 9000; });
  const StereoFrame expected = load_frame(drifting.sequence, 0);
  for (const auto* scan : {&drifting, &unlike}) {
    CHECK(scan->sequence.scale.by_median);
    REQUIRE(scan->problems.size() == 1);
    CHECK_THAT(scan->problems[0].text, Catch::Contains("the median of each image is read as medium grey"));
    for (std::size_t i = 0; i < scan->sequence.frames.size(); ++i) {
      const StereoFrame frame = load_frame(scan->sequence, i);
      CHECK(share_between(frame.left, 1, 254) > 0.97);
      CHECK(check_stereo_agreement({frame}).matches >= StereoAgreement::kEnoughMatches);
    }
    CHECK(cv::norm(load_frame(scan->sequence, 0).left, expected.left, cv::NORM_INF) <= 1.0);
  }
}

TEST_CASE("Values that differ by noise only are not spread over all grey levels", "[image]") {
  const TemporaryFolder folder;
  const SequenceScan scan = scan_16_bit(folder.path(), 7000.0, 4.0 / 255.0);
  CHECK(scan.sequence.scale.step == 1.0);
  double least = 0.0;
  double most = 0.0;
  cv::minMaxLoc(load_frame(scan.sequence, 1).left, &least, &most);
  CHECK(most - least <= 4.0);
}

TEST_CASE("A camera of 10 to 16 bits keeps the scale of its bits while the images have contrast", "[image]") {
  const TemporaryFolder folder;
  for (const int bits : {10, 12, 14, 16}) {
    CAPTURE(bits);
    const SequenceScan scan = scan_16_bit(folder.path(), 0.0, std::ldexp(1.0, bits - 8));
    CHECK(scan.sequence.scale == GreyScale::of_bits(bits));
    CHECK(scan.problems.size() == (bits == 16 ? 0 : 1));
  }
}

TEST_CASE("Images of 8 bits among those of 12 in 16 keep their grey levels, and a warning counts both",
          "[image]") {
  const TemporaryFolder folder;
  const auto to_8_bits = [](cv::Mat& image) { image.convertTo(image, CV_8U, 1.0 / 16.0); };
  int images = 0;  // left and right ones in turn
  const SequenceScan one_camera = scan_16_bit(folder / "one", 0.0, 16.0, [&](cv::Mat& image, int) {
    if (images++ % 2 == 0) to_8_bits(image);
  });
  const SequenceScan from_a_frame_on =
      scan_16_bit(folder / "late", 0.0, 16.0, [&](cv::Mat& image, int frame) {
        if (frame < 4) to_8_bits(image);
      });
  const SequenceScan at_first = scan_16_bit(folder / "first", 0.0, 16.0, [&](cv::Mat& image, int frame) {
    if (frame >= 4) to_8_bits(image);
  });
  const SequenceScan all = scan_16_bit(folder / "all", 0.0, 16.0);
  for (const auto* scan : {&one_camera, &from_a_frame_on, &at_first}) {
    CHECK(scan->sequence.scale == GreyScale::of_bits(12));
    REQUIRE(scan->problems.size() == 2);
    CHECK_THAT(scan->problems[0].text, Catch::Contains("of the 12 images examined have 8 bits a pixel"));
    for (const std::size_t i : {0U, 5U}) {
      const StereoFrame mixed = load_frame(scan->sequence, i), expected = load_frame(all.sequence, i);
      CHECK(cv::norm(mixed.left, expected.left, cv::NORM_INF) <= 1.0);
      CHECK(cv::norm(mixed.right, expected.right, cv::NORM_INF) <= 1.0);
    }
  }
}

TEST_CASE("An unreadable pair among those examined does not change the scale", "[image]") {
  const TemporaryFolder folder;
  const SequenceScan whole = scan_16_bit(folder.path(), 7000.0, 3.0);
  truncate_file(folder / "16/image_1/000003.png", 0.5);
  const SequenceScan scan = scan_sequence(folder / "16", "auto");
  CHECK(scan.sequence.scale.step == Approx(whole.sequence.scale.step).epsilon(0.05));
  CHECK_THAT(scan.problems.at(0).text, Catch::Contains("in the 5 pairs examined"));
}

TEST_CASE("Images of 16 bits whose bytes are exchanged are refused, and those that are right are not",
          "[image]") {
  const TemporaryFolder folder;
  struct Camera {
    double black;
    double step;
  };
  // Cameras of 10, 12, 14 and 15 bits, and thermal ones.
  for (const auto& [black, step] :
       {Camera{0.0, 4.0}, Camera{0.0, 16.0}, Camera{0.0, 64.0}, Camera{300.0, 120.0},
        Camera{7000.0, 900.0 / 255.0}, Camera{21000.0, 20.0}}) {
    CAPTURE(black, step);
    for (const auto& problem : scan_16_bit(folder.path(), black, step).problems)
      CHECK_FALSE(is_error(problem));
    const SequenceScan scan = scan_16_bit(folder.path(), black, step, exchange_bytes);
    REQUIRE(scan.problems.size() == 1);
    CHECK(is_error(scan.problems[0]));
    CHECK_THAT(scan.problems[0].text,
               Catch::Contains("the two bytes of the values of 16 bits look exchanged"));
  }
}

TEST_CASE("Exchanged bytes of which one is empty change nothing", "[image]") {
  const TemporaryFolder folder;
  const SequenceScan right = scan_16_bit(folder / "right", 0.0, 256.0);
  const SequenceScan exchanged = scan_16_bit(folder / "exchanged", 0.0, 256.0, exchange_bytes);
  CHECK(std::ranges::none_of(exchanged.problems, is_error));
  CHECK(cv::norm(load_frame(right.sequence, 1).left, load_frame(exchanged.sequence, 1).left, cv::NORM_INF) ==
        0.0);
}

TEST_CASE("Images of noise alone are not taken for images with exchanged bytes", "[image]") {
  const TemporaryFolder folder;
  cv::RNG random(5);
  for (const double sigma : {3.0, 40.0, 2000.0}) {
    const SequenceScan scan = scan_16_bit(folder.path(), 0.0, 1.0, [&](cv::Mat& image, int) {
      random.fill(image, cv::RNG::NORMAL, 9000.0, sigma);
    });
    CHECK(std::ranges::none_of(scan.problems, is_error));
  }
}
