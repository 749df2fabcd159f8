// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/recording_checks.hpp"

#include <array>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

using Order = std::array<std::size_t, 4>;

/// The warning about the tiny recording, whose images have 320 x 120 pixels, with this camera.
std::string warning_with(const std::string& camera) {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 3);
  write_text(folder / "calibration.yaml",
             "rectified: {" + camera + ", baseline_m: 0.4}\nframe_rate_hz: 10\n");
  const auto scan = scan_sequence(folder.path(), "auto");
  return scan.problems.empty() ? "" : scan.problems[0].text;
}

}  // namespace

TEST_CASE("Exchanged numbers of a camera are found if only one order fits the images", "[checks]") {
  // fx, fy, cx, cy of EuRoC, KITTI 00 and a camera with a view of 90 degrees
  CHECK_FALSE(likely_order({{458.7, 457.3, 367.2, 248.4}, 752, 480}));
  CHECK_FALSE(likely_order({{718.9, 718.9, 607.2, 185.2}, 1241, 376}));
  CHECK_FALSE(likely_order({{320.0, 320.0, 320.0, 240.0}, 640, 480}));
  CHECK(likely_order({{367.2, 248.4, 458.7, 457.3}, 752, 480}) == Order{2, 3, 0, 1});  // cx, cy, fx, fy
  CHECK(likely_order({{458.7, 367.2, 457.3, 248.4}, 752, 480}) == Order{0, 2, 1, 3});  // fx, cx, fy, cy
  CHECK(likely_order({{367.2, 457.3, 458.7, 248.4}, 752, 480}) == Order{2, 1, 0, 3});  // fx and cx
  CHECK(likely_order({{607.2, 718.9, 718.9, 185.2}, 1241, 376}) == Order{2, 1, 0, 3});
  CHECK(likely_order({{458.7, 457.3, 248.4, 367.2}, 752, 480}) == Order{0, 1, 3, 2});  // cx and cy
  // Off the middle in whatever order: another size, or cropped images.
  CHECK_FALSE(likely_order({{718.9, 718.9, 300.0, 90.0}, 1241, 376}));
  CHECK_FALSE(likely_order({{1.0, 1.0, 1.0, 1.0}, 752, 480}));
  CHECK(order_text({2, 1, 0, 3}) == "fx and cx look exchanged");
  CHECK(order_text({2, 3, 0, 1}) ==
        "the numbers look to be cx, cy, fx, fy where fx, fy, cx, cy are expected");
}

TEST_CASE("The likeliest cause of a principal point far from the middle is named", "[checks]") {
  CHECK(warning_with("fx: 250, fy: 250, cx: 160, cy: 60").empty());
  CHECK_THAT(warning_with("fx: 160, fy: 250, cx: 250, cy: 60"), Catch::Contains("fx and cx look exchanged"));
  CHECK_THAT(
      warning_with("fx: 250, fy: 250, cx: 318, cy: 61"),
      Catch::Contains("squeezed to half their width") && Catch::Contains("stretch them to 640x120 px"));
  CHECK_THAT(warning_with("fx: 250, fy: 250, cx: 158, cy: 119"),
             Catch::Contains("squeezed to half their height") && Catch::Contains("halve fy and cy"));
  CHECK_THAT(warning_with("fx: 400, fy: 400, cx: 318, cy: 119"),
             Catch::Contains("looks made for images of about"));
}

TEST_CASE("A distortion that no lens has by its model, and lenses have by the other one, is named",
          "[checks]") {
  const auto warning_with_lenses = [](const std::string& model, const std::string& coefficients) {
    const TemporaryFolder folder;
    write_tiny_folders(folder.path(), 3);
    const std::string lens = fmt::format(
        "{{resolution: [320, 120], intrinsics: [195, 195, 160, 60], distortion_model: {}, "
        "distortion_coefficients: [{}]}}\n",
        model, coefficients);
    write_text(folder / "calibration.yaml",
               "left: " + lens + "right: " + lens +
                   "T_right_left: [1, 0, 0, -0.4, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nframe_rate_hz: 10\n");
    std::string text;
    for (const auto& problem : scan_sequence(folder.path(), "auto").problems) text += problem.text + "\n";
    return text;
  };
  const std::string euroc = "-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05";
  const std::string tum_vi = "0.0034823894, 0.0007150348, -0.0020532361, 0.0002029367";
  CHECK(warning_with_lenses("radtan", euroc).empty());
  CHECK(warning_with_lenses("equidistant", tum_vi).empty());
  CHECK_THAT(
      warning_with_lenses("equidistant", euroc),
      Catch::Contains("by the model equidistant that the calibration names, and lenses have them by rad"));
  // A view of 80 degrees may have this distortion, too: only the images can tell.
  CHECK(warning_with_lenses("radtan", tum_vi).empty());
}
