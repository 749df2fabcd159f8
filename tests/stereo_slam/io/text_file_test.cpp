// SPDX-License-Identifier: MIT
#include "stereo_slam/io/text_file.hpp"

#include <clocale>
#include <limits>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("Lines keep their numbers when blanks, comments and carriage returns are dropped", "[text]") {
  const TemporaryFolder folder;
  write_text(folder / "a.txt", "# head\r\n\r\none\r\n   \n  # tail\ntwo");
  const auto lines = read_text_lines(folder / "a.txt");
  REQUIRE(lines.size() == 2);
  CHECK(lines[0].number == 3);
  CHECK(lines[0].text == "one");
  CHECK(lines[1].number == 6);
  CHECK(lines[1].text == "two");
}

TEST_CASE("A byte order mark is skipped at the beginning of a file only", "[text]") {
  const TemporaryFolder folder;
  write_text(folder / "a.txt",
             "\xEF\xBB\xBF# head\n\xEF\xBB\xBF"
             "1\n");
  const auto lines = read_text_lines(folder / "a.txt");
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].text ==
        "\xEF\xBB\xBF"
        "1");
  write_text(folder / "b.txt",
             "\xEF\xBB\xBF"
             "0.5\n");
  CHECK(read_text_lines(folder / "b.txt").at(0).text == "0.5");
}

TEST_CASE("A zero byte does not end a message", "[text]") {
  using namespace std::string_literals;
  CHECK(at_line("a.txt", 3, "'0.2\0\x1B' is no time"s) ==
        "a.txt:3: '0.2?"
        "?' is no time");
}

TEST_CASE("A file with a zero byte is not taken as text", "[text]") {
  using namespace std::string_literals;
  const TemporaryFolder folder;
  write_text(folder / "a.txt", "1 2\n3 \0"s);
  CHECK_THAT(message_of([&] { (void)read_text_lines(folder / "a.txt"); }),
             Catch::Contains("a.txt:2: there is a zero byte"));
}

TEST_CASE("A file that cannot be read is named", "[text]") {
  const TemporaryFolder folder;
  CHECK_THAT(message_of([&] { (void)read_text_lines(folder / "none.txt"); }),
             Catch::Contains("none.txt: cannot be read"));
  CHECK_THAT(message_of([&] { (void)read_text_lines(folder.path()); }), Catch::Contains("cannot be read"));
}

TEST_CASE("Numbers are parsed whole or not at all", "[text]") {
  CHECK(parse_numbers("1 -2.5e3,+4\t.5") == std::vector<double>{1.0, -2500.0, 4.0, 0.5});
  CHECK(parse_numbers("  ") == std::vector<double>{});
  for (const auto* bad : {"1 two", "1.0x", "nan", "1 inf", "-", "1e999", "0x10"}) {
    CAPTURE(bad);
    CHECK_FALSE(parse_numbers(bad).has_value());
  }
}

TEST_CASE("Stamps keep their nanoseconds", "[text]") {
  for (const auto* text :
       {"0.000000000", "12.345678901", "1403715524.907143168", "-0.000000001", "-3.250000000"}) {
    CAPTURE(text);
    const auto stamp_ns = parse_seconds(text);
    REQUIRE(stamp_ns.has_value());
    CHECK(format_seconds(*stamp_ns) == text);
  }
  CHECK(parse_seconds("1.403715529112143517e+09") == 1403715529112143517);
  for (const auto* bad : {"", "abc", "1s", "nan", "inf", "1e30", "4.000000001e9", "-9e9"}) {
    CAPTURE(bad);
    CHECK_FALSE(parse_seconds(bad).has_value());
  }
}
