// SPDX-License-Identifier: MIT
#include "stereo_slam/results/learned_cameras.hpp"

#include <cmath>
#include <sstream>
#include <string>

#include "stereo_slam/support/random_map.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

using test::message_of;
using test::TemporaryFolder;
using test::write_text;

LearnedCameras learned_cameras() {
  const SavedMap map = test::map_of(1, 1);
  return {map.camera, map.rectification};
}

std::string text_of(const LearnedCameras& learned) {
  std::ostringstream stream;
  write_learned_cameras(stream, learned);
  return stream.str();
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), by);
}

TEST_CASE("What was learned of the cameras is read as it was written", "[stereo_slam][results]") {
  const TemporaryFolder folder;
  const LearnedCameras learned = learned_cameras();
  write_text(folder / "cameras.yaml", text_of(learned));
  const LearnedCameras read = read_learned_cameras(folder / "cameras.yaml");
  CHECK(read.camera.fx == learned.camera.fx);
  CHECK(read.camera.baseline_m == learned.camera.baseline_m);
  CHECK(read.camera.width_px == learned.camera.width_px);
  const auto same = [](const auto& a, const auto& b) { return a.isApprox(b, 1e-9); };
  CHECK(same(read.estimate.row_information, learned.estimate.row_information));
  CHECK(same(read.estimate.row_vector, learned.estimate.row_vector));
  CHECK(same(read.estimate.disparity_information, learned.estimate.disparity_information));
  CHECK(same(read.estimate.disparity_vector, learned.estimate.disparity_vector));
  // What is in use are the means.
  const CameraErrors::Coefficients mean =
      learned.estimate.disparity_information.ldlt().solve(learned.estimate.disparity_vector);
  CHECK(same(read.estimate.lens, mean.tail<LensResidual::kTerms>()));
}

TEST_CASE("A delay of the right images is read as it was written, and none if there was none",
          "[stereo_slam][results]") {
  const TemporaryFolder folder;
  LearnedCameras learned = learned_cameras();
  write_text(folder / "cameras.yaml", text_of(learned));
  CHECK_FALSE(read_learned_cameras(folder / "cameras.yaml").estimate.delay);
  learned.estimate.delay = {.seconds = -0.02, .sigma_s = 1e-4};
  const std::string text = text_of(learned);
  write_text(folder / "cameras.yaml", text);
  const auto delay = read_learned_cameras(folder / "cameras.yaml").estimate.delay;
  REQUIRE(delay);
  CHECK(std::abs(delay->seconds + 0.02) < 1e-15);
  CHECK(std::abs(delay->sigma_s - 1e-4) < 1e-15);
  write_text(folder / "cameras.yaml", replaced(text, "sigma_ms: 0", "sigma_ms: -0"));
  CHECK_THAT(message_of([&] { (void)read_learned_cameras(folder / "cameras.yaml"); }),
             Catch::Contains("sigma_ms is not positive"));
}

TEST_CASE("A file that is not what a run learned is refused, and the message names it",
          "[stereo_slam][results]") {
  const TemporaryFolder folder;
  const auto file = folder / "cameras.yaml";
  const auto refusal = [&](const std::string& text) {
    write_text(file, text);
    return message_of([&] { (void)read_learned_cameras(file); });
  };
  const std::string text = text_of(learned_cameras());
  CHECK_THAT(message_of([&] { (void)read_learned_cameras(folder / "none.yaml"); }),
             Catch::Contains("none.yaml"));
  for (const auto& other : {std::string(), std::string("fx: 700\n"), std::string("- 1\n")}) {
    CHECK_THAT(refusal(other),
               Catch::Contains("cameras.yaml") && Catch::Contains("give the cameras.yaml of a run's output"));
  }
  CHECK_THAT(refusal(replaced(text, "format: 1", "format: 9")), Catch::Contains("format 9"));
  CHECK_THAT(refusal(replaced(text, "fx: ", "fx: nan#")), Catch::Contains("cameras.yaml"));
  CHECK_THAT(refusal(replaced(text, "width_px: ", "width_px: -")), Catch::Contains("cameras.yaml"));
  CHECK_THAT(refusal(replaced(text, "width_px: ", "width_px: 9e99#")), Catch::Contains("cameras.yaml"));
  CHECK_THAT(refusal(replaced(text, "height_px: 376}", "height_px: 9e99}")),
             Catch::Contains("height_px is 9e+99"));
  CHECK_THAT(refusal(replaced(text, "lens_error", "lens")), Catch::Contains("unknown key"));
  CHECK_THAT(refusal(replaced(text, "    - [", "    - [-")), Catch::Contains("not a covariance"));
  CHECK_THAT(refusal(text.substr(0, text.size() / 2)), Catch::Contains("cameras.yaml"));
  CHECK_THAT(refusal(text.substr(0, text.rfind("    - "))), Catch::Contains("132 numbers"));
}

}  // namespace
}  // namespace stereo_slam
