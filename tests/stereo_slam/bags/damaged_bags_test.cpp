// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/support/bags.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("A bag whose stamps go back is refused, and the image is named", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  CHECK_THAT(
      error_of(*folder / "back.bag"),
      Catch::Contains("/stereo/left/image_raw: 2 of its 5 images are out of order: the stamp of image 3") &&
          Catch::Contains("is earlier than") && Catch::Contains("1500000000.1") &&
          !Catch::Contains("reindex"));
}

TEST_CASE("Lengths in a bag that cannot be are refused before memory is allocated for them", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  // The data of a chunk, and what lz4 says it unpacks to.
  for (const std::string_view name : {"stereo.bag", "lz4.bag"}) {
    const std::string whole = read_text(*folder / name);
    const std::size_t size = whole.find("size=");
    REQUIRE(size != std::string::npos);
    std::string changed = whole;
    changed.replace(size + 5, 4, "\xff\xff\xff\xff");
    write_text(*folder / "huge.bag", changed);
    CHECK_THAT(error_of(*folder / "huge.bag"), Catch::Contains("more than 1 GB"));
    // Every length in the last records, those of the index: as if the bag had another 2 GB.
    const std::size_t index = whole.rfind("op=\x06");
    REQUIRE(index != std::string::npos);
    for (std::size_t at = index; at + 4 < whole.size(); at += 1) {
      CAPTURE(name, at);
      changed = whole;
      changed[at + 3] = '\x7f';
      write_text(*folder / "huge.bag", changed);
      const auto scan = scan_bag(*folder / "huge.bag", {});  // must not end the program
      for (const auto& problem : scan.problems) CHECK(problem.text.size() < 1000);
    }
  }
}

TEST_CASE("Errors of the library that reads bags are in plain words", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  const std::string whole = read_text(*folder / "stereo.bag");
  const auto error_with = [&](const std::string& bytes) {
    write_text(*folder / "changed.bag", bytes);
    return error_of(*folder / "changed.bag");
  };
  CHECK_THAT(error_with("#ROSBAG V9.3\n" + whole.substr(13)),
             Catch::Contains("is a bag of version 9.3, which is not read") && !Catch::Contains("reindex"));
  CHECK_THAT(error_with(""),
             Catch::Contains("the first line, '#ROSBAG V2.0', is not there") && Catch::Contains("reindex"));
  // The name of the distortion model, in the first camera_info, is longer than its message.
  const std::size_t model = whole.find(std::string("\x09\0\0\0plumb_bob", 13));
  REQUIRE(model != std::string::npos);
  std::string longer = whole;
  longer[model + 2] = '\x7f';
  CHECK_THAT(error_with(longer), Catch::Contains("a message ends within its fields"));
}

TEST_CASE("An image of another size in a bag is named", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  const auto scan = scan_bag(*folder / "wider.bag", {});
  REQUIRE(scan.problems.empty());
  CHECK(load_frame(scan.sequence, 2).right.cols == 320);
  CHECK_THAT(message_of([&] { (void)load_frame(scan.sequence, 3); }),
             Catch::Contains("wider.bag: frame 3 of /stereo/right/image_raw: is 321x120 pixels"));
}

TEST_CASE("Bags that cannot be used are refused in one line", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  CHECK_THAT(error_of(*folder / "nowhere.bag"), Catch::Contains("no such file"));
  CHECK_THAT(error_of("/dev/null"), Catch::Contains("not an ordinary file"));
  write_text(*folder / "text.bag", "no bag");
  CHECK_THAT(error_of(*folder / "text.bag"), Catch::Contains("is no bag of ROS 1"));
  write_text(*folder / "empty.bag", "");
  CHECK_THAT(error_of(*folder / "empty.bag"), Catch::Contains("the bag is cut off or damaged"));
  fs::create_directory(*folder / "folder.bag");
  CHECK_THAT(error_of(*folder / "folder.bag"), Catch::Contains("is a folder"));
  fs::remove(*folder / "folder.bag");
  CHECK_THAT(error_of(*folder / "strange.bag"),
             Catch::Contains("image 0 of /stereo/left/image_raw: the encoding '32FC1'") &&
                 !Catch::Contains("reindex"));
  CHECK_THAT(error_of(*folder / "swapped.bag"), Catch::Contains("the two are swapped"));
  CHECK_THAT(error_of(*folder / "fisheye.bag"), Catch::Contains(": /stereo/right/camera_info: "));
  const std::string whole = read_text(*folder / "stereo.bag");
  for (const double share : {0.01, 0.3, 0.6, 0.99}) {
    CAPTURE(share);
    write_text(*folder / "cut.bag",
               whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
    CHECK_THAT(error_of(*folder / "cut.bag"), Catch::Contains("`rosbag reindex`"));
  }
}
