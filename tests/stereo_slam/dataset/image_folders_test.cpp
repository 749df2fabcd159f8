// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/image_folders.hpp"

#include <vector>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// A recording whose images have these names, without extension.
class NamedRecording {
 public:
  NamedRecording(const std::vector<std::string>& left, const std::vector<std::string>& right) {
    write_tiny_folders(folder_.path(), static_cast<int>(std::max(left.size(), right.size())));
    rename("left", left);
    rename("right", right);
  }

  [[nodiscard]] SequenceScan scan() const { return scan_sequence(folder_.path(), "auto"); }
  [[nodiscard]] std::string error() const {
    return message_of([&] { (void)open_sequence(folder_.path(), "auto"); });
  }
  void remove(const fs::path& image) const { fs::remove(folder_ / image); }
  void replace_by_link(const fs::path& image, const fs::path& target) const {
    remove(image);
    fs::create_symlink(target, folder_ / image);
  }

 private:
  void rename(const std::string& side, const std::vector<std::string>& names) const {
    for (std::size_t i = 0; i < names.size(); ++i)
      fs::rename(folder_ / side / frame_name(static_cast<int>(i)), folder_ / side / (names[i] + ".png"));
  }

  TemporaryFolder folder_;
};

std::vector<std::string> numbered(const std::string& text, int count) {
  std::vector<std::string> names;
  names.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) names.push_back(fmt::format("{}{:06}", text, i));
  return names;
}

std::vector<std::string> stamps(int count, std::int64_t offset_ns) {
  std::vector<std::string> names;
  names.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    names.push_back(std::to_string(1'403'636'579'763'555'584 + i * std::int64_t{100'000'000} + offset_ns));
  return names;
}

}  // namespace

TEST_CASE("Names that are seconds with decimals are sorted as numbers and are the stamps", "[folders]") {
  // Python writes 1700000000.30 without its last zero.
  const std::vector<std::string> names = {"1700000000.1", "1700000000.25", "1700000000.3", "1700000001.05"};
  const NamedRecording recording(names, names);
  const auto frames = recording.scan().sequence.frames;
  REQUIRE(frames.size() == names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    CHECK(frames[i].left.stem() == names[i]);
    CHECK(frames[i].right.stem() == names[i]);
  }
  CHECK(frames[0].stamp_ns == 1'700'000'000'100'000'000);
  CHECK(frames[3].stamp_ns == 1'700'000'001'050'000'000);
}

TEST_CASE("Images of both cameras are in the order of the stamps in their names", "[folders]") {
  // Seconds and a counter of microseconds without leading zeros.
  const auto names = [](const std::string& side) {
    std::vector<std::string> result;
    result.reserve(50);
    for (int i = 0; i < 50; ++i)
      result.push_back(fmt::format("{}_{}.{}", side, 1'626'962'384 + i / 20, i % 20 * 50'000));
    return result;
  };
  const auto scan = NamedRecording(names("left"), names("right")).scan();
  CHECK(scan.problems.size() == 1);  // frame_rate_hz is 10
  CHECK_THAT(scan.problems[0].text, Catch::Contains("give 20 frames per second, but frame_rate_hz is 10"));
  const auto& frames = scan.sequence.frames;
  REQUIRE(frames.size() == 50);
  for (std::size_t i = 0; i < 50; ++i) {
    CHECK(frames[i].left.stem() == names("left")[i]);
    CHECK(frames[i].right.stem() == names("right")[i]);
    CHECK(frames[i].stamp_ns == 1'626'962'384'000'000'000 + static_cast<std::int64_t>(i) * 50'000'000);
  }
}

TEST_CASE("Names that may be decimals or counters are refused, whatever the frame rate", "[folders]") {
  const std::vector<std::string> names = {"1626962384.9", "1626962384.31", "1626962384.123"};
  CHECK_THAT(NamedRecording(names, names).error(),
             Catch::Contains("/left: 1626962384.9 may be the decimal number"));
}

TEST_CASE("Times in names with different texts are refused", "[folders]") {
  const auto error = [](const std::vector<std::string>& names) {
    return NamedRecording(names, names).error();
  };
  CHECK_THAT(error({"a_1626962384.5", "a_1626962384.55", "b_1626962384.6", "b_1626962384.65"}),
             Catch::Contains("a_1626962384.5 contains a time, and b_1626962384.6 has another text than it"));
  CHECK_THAT(error({"-0.10", "-0.05", "0.00", "0.05"}), Catch::Contains("-0.05 may be a negative time"));
}

TEST_CASE("Times in a unit that is not certain leave gaps where images are missing", "[folders]") {
  std::vector<std::string> names;
  for (int i = 0; i < 12; ++i) {  // in 100 ns
    if (i != 4 && i != 5) names.push_back(std::to_string(16'269'623'840'000'000 + i * 1'000'000 + i * i));
  }
  const auto scan = NamedRecording(names, names).scan();
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(scan.problems[0].text, Catch::Contains("2 numbers are missing"));
  REQUIRE(scan.sequence.frames.size() == 10);
  CHECK(scan.sequence.frames[3].stamp_ns == 300'000'000);
  CHECK(scan.sequence.frames[4].stamp_ns == 600'000'000);
}

TEST_CASE("Hidden files among the images are left out", "[folders]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 3);
  for (int i = 0; i < 3; ++i) write_text(folder / "left" / ("._" + frame_name(i)), "of macOS");
  CHECK(open_sequence(folder.path(), "auto").frames.size() == 3);
}

TEST_CASE("An image without a number among numbered ones is refused; texts before the numbers may differ",
          "[folders]") {
  const auto error_with = [](const std::string& text, const std::string& odd) {
    auto names = numbered(text, 5);
    names.push_back(odd);
    return NamedRecording(names, names).error();
  };
  CHECK_THAT(
      error_with("", "000004 (1)"),
      Catch::Contains("000004 (1).png: its name is not digits only, as those of 5 of the 6 images are"));
  for (const auto* odd : {"000004 - Copy", "000004_1", "mask", "000004 copy 2"})
    CHECK_THAT(error_with("", odd), Catch::Contains(std::string(odd) + ".png: its name is not digits only"));
  CHECK_THAT(error_with("frame_", "frame_000004 (1)"),
             Catch::Contains(".png: its name is not 'frame_' and a number"));
  CHECK(error_with("first_", "second_000000").empty());
  CHECK(error_with("", "1403636579763555584").empty());
}

TEST_CASE("An image that is a link to nothing is named, and costs its own frame only", "[folders]") {
  const NamedRecording recording(numbered("", 6), numbered("", 6));
  recording.replace_by_link("right/000003.png", "/nowhere/000003.png");
  const StereoSequence sequence = recording.scan().sequence;
  REQUIRE(sequence.frames.size() == 6);
  CHECK_THAT(message_of([&] { (void)load_frame(sequence, 3); }),
             Catch::Contains("right/000003.png: is a link to a file that does not exist; restore"));
  CHECK(load_partial_frame(sequence, 3).has_left());
}

TEST_CASE("A counter of images that begins again after its last number is refused", "[folders]") {
  std::vector<std::string> names;
  for (int i = 9996; i < 10'002; ++i) names.push_back(fmt::format("{:04}", i % 10'000));
  CHECK_THAT(NamedRecording(names, names).error(),
             Catch::Contains("begin again at 0 after 9999") && Catch::Contains("add 10000 to those up to 1"));
  names.clear();
  for (int i = 0; i < 12; ++i) names.push_back(fmt::format("{:03}", 988 + i));  // ends with 999
  CHECK(NamedRecording(names, names).scan().problems.empty());
}

TEST_CASE("Images whose names differ between the cameras are paired by their numbers", "[folders]") {
  const NamedRecording recording(numbered("L_", 12), numbered("R_", 12));
  CHECK(recording.scan().problems.empty());
  recording.remove("left/L_000003.png");
  recording.remove("right/R_000009.png");
  const auto scan = recording.scan();
  REQUIRE(scan.sequence.frames.size() == 10);
  for (const auto& frame : scan.sequence.frames)
    CHECK(frame.left.stem().string().substr(2) == frame.right.stem().string().substr(2));
  REQUIRE(scan.problems.size() == 2);
  CHECK_THAT(scan.problems[0].text, Catch::Contains("2 images have no partner of the same name or number"));
  CHECK_THAT(scan.problems[1].text, Catch::Contains("left: 1 number is missing among the names"));
  CHECK(scan.sequence.frames[3].stamp_ns == 400'000'000);
}

TEST_CASE("Of a single image no number is missing, also if its name could be a time", "[folders]") {
  const auto problems = NamedRecording({"1.600000e+09"}, {"1.600000e+09"}).scan().problems;
  for (const auto& problem : problems) CHECK_THAT(problem.text, !Catch::Contains("missing among the names"));
}

TEST_CASE("The last image of one camera may be missing, whatever the images are called", "[folders]") {
  const NamedRecording recording(numbered("L_", 12), numbered("R_", 12));
  recording.remove("right/R_000011.png");
  CHECK(recording.scan().sequence.frames.size() == 11);
}

TEST_CASE("Images are paired by order if the cameras count from different numbers", "[folders]") {
  std::vector<std::string> later = numbered("R_", 13);
  later.erase(later.begin());
  const auto scan = NamedRecording(numbered("L_", 12), later).scan();
  CHECK(scan.problems.empty());
  REQUIRE(scan.sequence.frames.size() == 12);
  CHECK(scan.sequence.frames[0].right.stem() == "R_000001");
}

TEST_CASE("Images without a number in common are paired by order, with a warning", "[folders]") {
  for (const auto* text : {"", "R_"}) {
    CAPTURE(text);
    std::vector<std::string> later = numbered(text, 13);
    later.erase(later.begin(), later.begin() + 10);
    const auto scan = NamedRecording(numbered("", 3), later).scan();
    REQUIRE(scan.sequence.frames.size() == 3);
    REQUIRE(scan.problems.size() == 1);
    CHECK_FALSE(is_error(scan.problems[0]));
    CHECK_THAT(scan.problems[0].text, Catch::Contains(fmt::format(
                                          "no number in common, so they are paired by order, 000000.png with "
                                          "{}000010.png",
                                          text)));
  }
}

TEST_CASE("Images whose names are stamps are paired with the nearest, whatever is missing", "[folders]") {
  const NamedRecording recording(stamps(12, 0), stamps(12, 300));
  CHECK(recording.scan().sequence.frames.size() == 12);
  recording.remove("left/" + stamps(12, 0)[3] + ".png");
  recording.remove("right/" + stamps(12, 300)[9] + ".png");
  const auto scan = recording.scan();
  REQUIRE(scan.sequence.frames.size() == 10);
  for (const auto& frame : scan.sequence.frames)
    CHECK(std::stoll(frame.right.stem()) - std::stoll(frame.left.stem()) == 300);
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(scan.problems[0].text,
             Catch::Contains("1 of 11 images of left and 1 of 11 of right have no partner within 50 ms"));
}

TEST_CASE("Cameras with clocks of their own are no pairs", "[folders]") {
  CHECK_THAT(NamedRecording(stamps(12, 0), stamps(12, 90'000'000'000)).error(),
             Catch::Contains("0 of 12 images of left") && Catch::Contains("the nearest are 88.9 s apart"));
}
