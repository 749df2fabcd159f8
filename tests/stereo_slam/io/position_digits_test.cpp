// SPDX-License-Identifier: MIT
#include "stereo_slam/io/position_digits.hpp"

#include <fmt/format.h>

#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// A path along x from UTM coordinates on, as a TUM file.
std::vector<std::string> remarks_on(fmt::string_view position, double step_m) {
  const TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 20; ++i) {
    const std::string xyz =
        fmt::format(fmt::runtime(position), 448252.123 + step_m * i, 5411932.678, 116.434);
    text += fmt::format("{} {} 0 0 0 1\n", 0.1 * i, xyz);
  }
  write_text(folder / "t.txt", text);
  return read_trajectory(folder / "t.txt").remarks;
}

}  // namespace

TEST_CASE("The place of the last digit counts exponents", "[position_digits]") {
  CHECK(last_decimal_place("448252.12") == -2);
  CHECK(last_decimal_place("448252") == 0);
  CHECK(last_decimal_place("4.48e+03") == 1);
  CHECK(last_decimal_place("4.48252123e+05") == -3);
  CHECK(last_decimal_place("1e-3") == -3);
  CHECK(last_decimal_place("-.5E0") == -1);
  CHECK(last_decimal_place("") == 0);
}

TEST_CASE("Large positions that lost their digits are named, others are not", "[position_digits]") {
  const auto cut = remarks_on("{:.6g} {:.6g} {:.6g}", 0.9);
  REQUIRE(cut.size() == 1);
  CHECK_THAT(cut[0],
             Catch::Contains("are written to 1 m only") || Catch::Contains("are written to 10 m only"));
  CHECK(remarks_on("{:.6e} {:.6e} {:.6e}", 0.01).size() == 1);
  CHECK(remarks_on("{:.3f} {:.3f} {:.3f}", 0.9).empty());
  CHECK(remarks_on("{:.12g} {:.12g} {:.12g}", 0.01).empty());
}

TEST_CASE("Whole numbers of a small path are exact", "[position_digits]") {
  const TemporaryFolder folder;
  write_text(folder / "t.txt", "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n3 2 0 0 0 0 0 1\n");
  CHECK(read_trajectory(folder / "t.txt").remarks.empty());
}

TEST_CASE("Poses that are written twice, and a body at rest, lost no digits", "[position_digits]") {
  const TemporaryFolder folder;
  std::string twice, rest;
  for (int i = 0; i < 40; ++i) {
    twice += fmt::format("{} {:.9f} 5.123456789 0 0 0 0 1\n", i, 0.8 * (i / 2));
    rest += fmt::format("{} 448252.123456789 0 0 0 0 0 1\n", i);
  }
  write_text(folder / "twice.txt", twice);
  write_text(folder / "rest.txt", rest);
  CHECK(read_trajectory(folder / "twice.txt").remarks.empty());
  CHECK(read_trajectory(folder / "rest.txt").remarks.empty());
}
