// SPDX-License-Identifier: MIT
#include "stereo_slam/stamps/name_times.hpp"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "stereo_slam/stamps/calendar.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr std::int64_t kStart_ns = 1'626'962'384'000'000'000;  // 2021-07-22T13:59:44Z
constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// Stamps of 50 images at 20 Hz, each up to 3 ms early or late.
std::vector<std::int64_t> jittered_stamps(std::int64_t first_ns = kStart_ns) {
  std::vector<std::int64_t> stamps_ns;
  for (std::int64_t i = 0; i < 50; ++i)
    stamps_ns.push_back(first_ns + i * 50'000'000 + (i * i * 7'919'113) % 6'000'000);
  return stamps_ns;
}

/// Stamps of 50 images at exactly 20 Hz.
std::vector<std::int64_t> even_stamps(std::int64_t first_ns = kStart_ns) {
  std::vector<std::int64_t> stamps_ns;
  for (std::int64_t i = 0; i < 50; ++i) stamps_ns.push_back(first_ns + i * 50'000'000);
  return stamps_ns;
}

/// "5.05": as Python writes numbers.
std::string shortened(std::int64_t ns) {
  std::string text = fmt::format("{}.{:09}", ns / kSecond_ns, ns % kSecond_ns);
  text.erase(text.find_last_not_of('0') + 1);
  return text.back() == '.' ? text + "0" : text;
}

/// "20210722135944".
std::string date_of(std::int64_t ns) {
  const std::int64_t second = ns / kSecond_ns - kStart_ns / kSecond_ns;
  return fmt::format("202107221359{:02}", 44 + second);
}

using Spell = std::function<std::string(std::int64_t)>;

std::vector<std::string> spelled(const std::vector<std::int64_t>& stamps_ns, const Spell& spell) {
  std::vector<std::string> names;
  for (const auto ns : stamps_ns) names.push_back(spell(ns));
  return names;
}

/// The names of images are read as stamps that are early by at most `rounding_ns`, in any order of the names.
void check_reading(const std::vector<std::int64_t>& stamps_ns, const Spell& spell, std::int64_t rounding_ns) {
  auto names = spelled(stamps_ns, spell);
  std::vector<std::size_t> order(names.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return names[a] < names[b]; });
  std::sort(names.begin(), names.end());
  CAPTURE(names);
  const NameTimes times = times_in(names);
  CHECK(times.doubt.empty());
  REQUIRE(times.stamps_ns.size() == names.size());
  CHECK(times.keys == times.stamps_ns);
  for (std::size_t i = 0; i < names.size(); ++i) {
    CAPTURE(names[i]);
    const std::int64_t early_ns = stamps_ns[order[i]] - times.stamps_ns[i];
    CHECK(early_ns >= 0);
    CHECK(early_ns <= rounding_ns);
  }
}

std::string refusal(const std::vector<std::string>& names) {
  return message_of([&] { (void)times_in(names); });
}

}  // namespace

TEST_CASE("Stamps since 1970 are read in the unit that their digits show", "[name_times]") {
  for (const auto& stamps_ns : {even_stamps(), jittered_stamps()}) {
    check_reading(
        stamps_ns, [](auto ns) { return fmt::format("{}", ns); }, 0);
    check_reading(
        stamps_ns, [](auto ns) { return fmt::format("{}", ns / 1000); }, 999);
    check_reading(
        stamps_ns, [](auto ns) { return fmt::format("cam0_{}_l", ns / 1'000'000); }, 999'999);
    check_reading(
        stamps_ns, [](auto ns) { return fmt::format("{}.{:03}", ns / 1'000'000, ns / 1000 % 1000); }, 999);
    check_reading(
        stamps_ns, [](auto ns) { return fmt::format("{:x}", ns); }, 0);
    check_reading(
        stamps_ns, [](auto ns) { return fmt::format("t_{:X}", ns / 1000); }, 999);
  }
}

TEST_CASE("Decimals of seconds are compared as numbers, also where zeros at their end are left out",
          "[name_times]") {
  for (const auto& stamps_ns : {even_stamps(), jittered_stamps()}) {
    check_reading(stamps_ns, shortened, 0);
    check_reading(
        stamps_ns, [](auto ns) { return "left_" + shortened(ns) + "_rgb"; }, 0);
    check_reading(
        stamps_ns, [](auto ns) { return fmt::format("{}.{:09}", ns / kSecond_ns, ns % kSecond_ns); }, 0);
    check_reading(
        stamps_ns, [](auto ns) { return fmt::format("{}_{:09}", ns / kSecond_ns, ns % kSecond_ns); }, 0);
    check_reading(
        stamps_ns,
        [](auto ns) {
          std::string text = shortened(ns);
          std::replace(text.begin(), text.end(), '.', ',');
          return text;
        },
        0);
  }
}

TEST_CASE("A counter after the point without leading zeros is no decimal fraction", "[name_times]") {
  for (const auto& stamps_ns : {even_stamps(), jittered_stamps()}) {
    for (const std::int64_t unit_ns : {1'000'000, 1'000, 1}) {
      for (const auto* divider : {".", "_", "-"}) {
        check_reading(
            stamps_ns,
            [&](auto ns) {
              return fmt::format("{}{}{}", ns / kSecond_ns, divider, ns % kSecond_ns / unit_ns);
            },
            unit_ns - 1);
      }
    }
  }
}

TEST_CASE("Names that may be decimals or counters, in two orders, are refused", "[name_times]") {
  CHECK_THAT(refusal({"1626962384.9", "1626962384.31", "1626962384.123"}),
             Catch::Contains("1626962384.9 may be the decimal number, or 1626962384 and a counter of 9"));
  // Counters of nanoseconds mostly have nine digits, so these seven are decimals, whatever the intervals.
  CHECK(refusal({"1626962384.9", "1626962384.31", "1626962384.1234567"}).empty());
  CHECK_THAT(refusal({"1626962384.9", "1626962384.310", "1626962384.12345"}),
             Catch::Contains("may be the decimal"));
  // Four images at equal intervals, if they are decimals.
  CHECK(refusal({"1626962384.9", "1626962385.15", "1626962385.4", "1626962385.65"}).empty());
}

TEST_CASE("Dates with the time of day are stamps, with and without dividers", "[name_times]") {
  for (const auto& stamps_ns : {even_stamps(), jittered_stamps()}) {
    const auto ms = [](auto ns) { return ns % kSecond_ns / 1'000'000; };
    check_reading(
        stamps_ns, [&](auto ns) { return fmt::format("{}{:03}", date_of(ns), ms(ns)); }, 999'999);
    check_reading(
        stamps_ns, [&](auto ns) { return fmt::format("{}{}", date_of(ns), ms(ns)); }, 999'999);
    check_reading(
        stamps_ns, [&](auto ns) { return fmt::format("{}.{:03}", date_of(ns), ms(ns)); }, 999'999);
    check_reading(
        stamps_ns,
        [&](auto ns) {
          const std::string date = date_of(ns);
          return fmt::format("img_{}_{}_{}", date.substr(0, 8), date.substr(8), ms(ns));
        },
        999'999);
    check_reading(
        stamps_ns,
        [&](auto ns) {
          const std::string date = date_of(ns);
          return fmt::format("2021-07-22T13-{}-{}.{:06}Z", date.substr(10, 2), date.substr(12),
                             ns % kSecond_ns / 1000);
        },
        999);
  }
  CHECK(seconds_of_date("20210722135944") == kStart_ns / kSecond_ns);
  CHECK(seconds_of_date("20000229235959") == 951'868'799);
  for (const auto* wrong :
       {"20210229000000", "20211301000000", "20210100000000", "20210101240000", "20210101006000",
        "20210101000060", "16269623840500", "2021010100000", "2021010100000x"})
    CHECK_FALSE(seconds_of_date(wrong));
}

TEST_CASE("Times from zero are read in the only unit that gives a frame rate", "[name_times]") {
  constexpr std::int64_t kFirst_ns = 150'000'000;
  for (const auto& stamps_ns : {even_stamps(kFirst_ns), jittered_stamps(kFirst_ns)}) {
    check_reading(stamps_ns, shortened, 0);
    check_reading(
        stamps_ns, [](auto ns) { return fmt::format("{}.{}", ns / 1'000'000, ns / 100'000 % 10); }, 99'999);
    check_reading(
        stamps_ns, [](auto ns) { return fmt::format("{}", ns / 1000); }, 999);
    check_reading(
        stamps_ns, [](auto ns) { return fmt::format("{:018}", ns); }, 0);
  }
  // Since the computer started.
  check_reading(
      even_stamps(123'456'789'000'000), [](auto ns) { return fmt::format("{}", ns); }, 0);
  check_reading(
      even_stamps(123'456'789'000'000), [](auto ns) { return fmt::format("{}", ns / 1000); }, 0);
  check_reading(
      jittered_stamps(kFirst_ns), [](auto ns) { return fmt::format("{}", ns / 1'000'000); }, 999'999);
}

TEST_CASE("Numbers of frames, and numbers that are something else, are no times", "[name_times]") {
  const auto no_times = [](const std::function<std::string(int)>& spell) {
    std::vector<std::string> names;
    for (int i = 0; i < 50; ++i) names.push_back(spell(i));
    CAPTURE(names[17]);
    const NameTimes times = times_in(names);
    CHECK(times.keys.empty());
    CHECK(times.doubt.empty());
  };
  no_times([](int i) { return fmt::format("{:06}", i); });
  no_times([](int i) { return fmt::format("{:014}", i + 3); });
  no_times([](int i) { return fmt::format("{:010}", 50 * i); });  // every 50th
  no_times([](int i) { return fmt::format("frame_{}", i * i % 7 + 7 * i); });
  no_times([](int i) { return fmt::format("f{:04}", i); });  // not hexadecimal
  no_times([](int i) { return fmt::format("1626962384_{:06}", i); });
  no_times([](int i) { return fmt::format("{}_{:02}", 1'626'962'384 + i / 20, i % 20); });
  no_times([](int i) { return fmt::format("20210722_1359{:02}_{:06}", 44 + i / 20, i); });
  no_times([](int i) { return fmt::format("{:06}_{}.{}", i, 20 + i % 3, i % 10); });  // a temperature
  no_times([](int i) { return fmt::format("{}", 1'626'962'384 + i); });               // whole seconds
  CHECK(times_in({}).keys.empty());
  CHECK(times_in({"a", "b"}).keys.empty());
  CHECK(times_in({"", "1"}).keys.empty());
  CHECK(times_in({"99999999999999999999999999", "99999999999999999999999998"}).keys.empty());
}

TEST_CASE("Hexadecimal numbers of frames are ordered by their values", "[name_times]") {
  std::vector<std::string> names;
  for (int i = 0; i < 50; ++i) names.push_back(fmt::format("frame_{:04x}", i + 3));
  const NameTimes times = times_in(names);
  CHECK(times.stamps_ns.empty());
  REQUIRE(times.keys.size() == 50);
  for (std::size_t i = 0; i < 50; ++i) CHECK(times.keys[i] == static_cast<std::int64_t>(i) + 3);
  CHECK_THAT(refusal({"0cc175b9c0f1b6a831c399e269772661", "92eb5ffee6ae2fec3ad71c777531578f"}),
             Catch::Contains("is a hexadecimal number of 32 digits, which gives no order of images"));
  CHECK_THAT(refusal({"0cc175b9", "92eb5ffe", "4a8a08f0"}),
             Catch::Contains("neither counts images nor is a time"));
}

TEST_CASE("Times in a unit that is not certain are in order, and the units named", "[name_times]") {
  std::vector<std::string> names;
  for (int i = 0; i < 50; ++i)
    names.push_back(std::to_string(16'269'623'840'000'000 + i * std::int64_t{500'017}));
  NameTimes times = times_in(names);  // 100 ns, as Windows counts them
  CHECK(times.stamps_ns.empty());
  CHECK(std::is_sorted(times.keys.begin(), times.keys.end()));
  CHECK_THAT(times.doubt, Catch::Contains("16269623840000000 is no time since 1970 in seconds"));
  names.clear();
  for (int i = 0; i < 50; ++i) names.push_back(fmt::format("{}.25", 1000 + i * 3 / 2));
  times = times_in({"1.5", "3.0", "4.5", "6.0"});
  CHECK(times.stamps_ns.empty());
  CHECK_THAT(times.doubt,
             Catch::Contains("1.5 may be in seconds (1.5 s between images) or in milliseconds (0.0015 s"));
}

TEST_CASE("Times with a sign before them are refused", "[name_times]") {
  CHECK_THAT(refusal({"-0.95", "-0.90", "-0.85"}), Catch::Contains("-0.95 may be a negative time"));
  CHECK_THAT(refusal({"t_-0.95", "t_-0.90", "t_-0.85"}), Catch::Contains("may be a negative time"));
  CHECK(times_in({"-1626962384.5", "-1626962384.45"}).stamps_ns.size() == 2);  // a divider
  CHECK(times_in({"cam-0.95", "cam-0.90", "cam-0.85"}).stamps_ns.size() == 3);
}

TEST_CASE("A number of the frame beside the stamp must be in the same order", "[name_times]") {
  const auto stamps_ns = jittered_stamps();
  std::vector<std::string> names;
  for (std::size_t i = 0; i < stamps_ns.size(); ++i)
    names.push_back(fmt::format("{:06}_{}", i, shortened(stamps_ns[i])));
  CHECK(times_in(names).stamps_ns == stamps_ns);
  std::swap(names[3], names[30]);
  CHECK(times_in(names).stamps_ns.size() == names.size());
  names[3] = fmt::format("{:06}_{}", 300, shortened(stamps_ns[30]));
  CHECK_THAT(refusal(names), Catch::Contains("by the stamps in their names, but earlier by the numbers"));
}

TEST_CASE("A lost image leaves its gap between the stamps", "[name_times]") {
  auto stamps_ns = jittered_stamps();
  stamps_ns.erase(stamps_ns.begin() + 17, stamps_ns.begin() + 22);
  check_reading(
      stamps_ns, [](auto ns) { return fmt::format("{}.{}", ns / kSecond_ns, ns % kSecond_ns / 1000); }, 999);
  check_reading(stamps_ns, shortened, 0);
}
