// SPDX-License-Identifier: MIT
#include "stereo_slam/app/progress.hpp"

#include "support/catch.hpp"

using namespace stereo_slam;

TEST_CASE("The progress says how long the job will still take", "[progress]") {
  const auto text = [](std::size_t done, std::optional<std::size_t> total, double seconds) {
    return progress_text({done, total, seconds}, "OK");
  };
  CHECK(text(200, 1000, 8.0) == "frame 200/1000  25.0 fps  0:32 left  OK");
  CHECK(text(10, 1000, 10.0) == "frame 10/1000  1.0 fps  16:30 left  OK");
  CHECK(text(1, 5000, 2.0) == "frame 1/5000  0.5 fps  2:46:38 left  OK");
  CHECK(text(10, 1000, 0.5) == "frame 10/1000  20.0 fps  OK");  // too early to say
  CHECK(text(1000, 1000, 40.0) == "frame 1000/1000  25.0 fps  OK");
  CHECK(text(0, 10, 5.0) == "frame 0/10  0.0 fps  OK");
  CHECK(text(50, std::nullopt, 2.0) == "frame 50  25.0 fps  OK");  // a live camera
  CHECK(text(1, 1'000'000'000, 1e6).find("left") != std::string::npos);
}
