// SPDX-License-Identifier: MIT
#include "stereo_slam/app/info.hpp"

#include <sstream>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

struct Info {
  std::size_t errors = 0;
  std::string text;
};

Info info_after(const std::function<void(const fs::path&)>& breaking) {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), 4);
  breaking(folder.path());
  const auto inspection = inspect(scan_sequence(folder.path(), "auto"));
  std::ostringstream out;
  print_inspection(out, inspection);
  const auto& problems = inspection.scan.problems;
  return {static_cast<std::size_t>(std::count_if(problems.begin(), problems.end(), is_error)), out.str()};
}

}  // namespace

TEST_CASE("A good recording is described and called usable", "[info]") {
  const auto info = info_after([](const fs::path&) {});
  CHECK(info.errors == 0);
  for (const auto* part :
       {"frames        4", "320 x 120 px", "fx 200", "baseline      0.4000 m", "10.00 frames per second",
        "ground truth  4 poses, 0.5 m", "row offset 0.00 px, disparity 10.0 px", "verdict       usable"}) {
    CHECK_THAT(info.text, Catch::Contains(part));
  }
}

TEST_CASE("Every problem of a recording is listed, not just the first", "[info]") {
  const auto info = info_after([](const fs::path& folder) {
    fs::remove(folder / "times.txt");
    write_text(folder / "calib.txt", projection_line("P0", 0) + projection_line("P1", 0));
    fs::remove(folder / "image_1/000002.png");
    truncate_file(folder / "image_0/000001.png", 0.5);
    cv::imwrite((folder / "image_1/000003.png").string(), tiny_texture(100));
  });
  CHECK(info.errors == 5);
  for (const auto* part : {"times.txt: missing", "baseline of zero", "image_1/000002.png: missing",
                           "image_0/000001.png: the PNG is truncated", "000003.png: is 100x120 pixels",
                           "not usable as a whole (5 errors)"}) {
    CHECK_THAT(info.text, Catch::Contains(part));
  }
}

TEST_CASE("Swapped cameras are found by their negative disparities", "[info]") {
  const auto info = info_after([](const fs::path& folder) {
    fs::rename(folder / "image_0", folder / "x");
    fs::rename(folder / "image_1", folder / "image_0");
    fs::rename(folder / "x", folder / "image_1");
  });
  CHECK(info.errors == 1);
  CHECK_THAT(info.text, Catch::Contains("image_0 and image_1 look swapped"));
}

TEST_CASE("Right images of another frame are not taken for swapped cameras where the camera is fast",
          "[info]") {
  constexpr int kShift_px = 14;  // a frame; more than the disparity, which becomes negative
  constexpr int kSink_px = 3;
  for (const bool late : {true, false}) {
    const auto info = info_after([&](const fs::path& folder) {
      cv::Mat texture;
      cv::resize(tiny_texture(500), texture, {}, 1.0, 1.3);
      const cv::Rect view(0, 0, TinySequence::kWidth, TinySequence::kHeight);
      const auto place = [](int i) { return cv::Point(kShift_px * i, kSink_px * i); };
      for (int i = 0; i < 4; ++i) {
        const int left = late ? i + 1 : 4 - i;  // early images have negative disparities on the way back
        cv::imwrite((folder / "image_0" / frame_name(i)).string(), texture(view + place(left)));
        cv::imwrite((folder / "image_1" / frame_name(i)).string(),
                    texture(view + place(left - 1) + cv::Point(TinySequence::kDisparity_px, 0)));
      }
    });
    CHECK(info.errors == 0);
    CHECK_THAT(info.text, Catch::Contains(fmt::format("image_1 look 1 frame {}", late ? "late" : "early")) &&
                              !Catch::Contains("swapped"));
  }
}

TEST_CASE("Images that are not rectified are found by the row offset of their features", "[info]") {
  const auto info = info_after([](const fs::path& folder) {
    for (int i = 0; i < 4; ++i) {
      const auto file = (folder / "image_1" / frame_name(i)).string();
      const cv::Mat image = cv::imread(file, cv::IMREAD_GRAYSCALE);
      cv::Mat shifted;
      cv::warpAffine(image, shifted, cv::Matx23d(1, 0, 0, 0, 1, 3), image.size(), cv::INTER_LINEAR,
                     cv::BORDER_REFLECT);
      cv::imwrite(file, shifted);
    }
  });
  CHECK(info.errors == 0);
  CHECK_THAT(info.text, Catch::Contains("warning") && Catch::Contains("lie 3.00 px apart in row"));
}

TEST_CASE("Colour images are mentioned", "[info]") {
  const auto info = info_after([](const fs::path& folder) {
    const auto file = (folder / "image_0/000001.png").string();
    cv::Mat colour;
    cv::cvtColor(cv::imread(file, cv::IMREAD_GRAYSCALE), colour, cv::COLOR_GRAY2BGR);
    cv::imwrite(file, colour);
  });
  CHECK(info.errors == 0);
  CHECK_THAT(info.text, Catch::Contains("images are in colour; they are converted to grey"));
}

TEST_CASE("Images without texture allow no verdict on the cameras", "[info]") {
  const auto info = info_after([](const fs::path& folder) {
    for (const auto* camera : {"image_0", "image_1"}) {
      for (int i = 0; i < 4; ++i) {
        cv::imwrite((folder / camera / frame_name(i)).string(),
                    cv::Mat(TinySequence::kHeight, TinySequence::kWidth, CV_8UC1, 90));
      }
    }
  });
  CHECK(info.errors == 0);
  CHECK_THAT(info.text, !Catch::Contains("stereo check"));
  CHECK_THAT(info.text, Catch::Contains("only 0 features match") &&
                            Catch::Contains("of image_0 and image_1 are dark, blank or blurred") &&
                            Catch::Contains("verdict       unknown"));
}

TEST_CASE("Images of two scenes are not called dark, and their recording is not called usable", "[info]") {
  const auto info = info_after([](const fs::path& folder) {
    cv::Mat other(TinySequence::kHeight, TinySequence::kWidth, CV_8UC1);
    cv::RNG random(8);
    for (int i = 0; i < 4; ++i) {
      random.fill(other, cv::RNG::UNIFORM, 0, 256);
      cv::GaussianBlur(other, other, {0, 0}, 1.5);
      cv::normalize(other, other, 0, 255, cv::NORM_MINMAX);
      cv::imwrite((folder / "image_1" / frame_name(i)).string(), other);
    }
  });
  CHECK(info.errors == 0);
  CHECK_THAT(info.text, Catch::Contains("do not seem to show the same scene") && !Catch::Contains("dark") &&
                            Catch::Contains("verdict       unknown"));
}

TEST_CASE("Nothing is said about the contents of images that cannot be read", "[info]") {
  const auto info = info_after([](const fs::path& folder) {
    for (int i = 0; i < 4; ++i) write_text(folder / "image_1" / frame_name(i), "no image");
  });
  CHECK(info.errors >= 1);
  CHECK_THAT(info.text, !Catch::Contains("features match") && !Catch::Contains("same scene") &&
                            Catch::Contains("not usable as a whole"));
}

TEST_CASE("Images that are damaged behind their header are not called dark", "[info]") {
  const auto info = info_after([](const fs::path& folder) {
    for (int i = 0; i < 4; ++i) {
      const auto file = folder / "image_1" / frame_name(i);
      std::string bytes = read_text(file);
      for (std::size_t k = bytes.size() / 2; k < bytes.size() / 2 + 40; ++k) bytes[k] = '\x55';
      write_text(file, bytes);
    }
  });
  CHECK(info.errors >= 1);
  CHECK_THAT(info.text, !Catch::Contains("features match") && Catch::Contains("not usable as a whole"));
}

TEST_CASE("A recording is usable while few of its images cannot be read, and not the first", "[info]") {
  const auto inspect_without = [](const std::vector<std::string>& images) {
    const TemporaryFolder folder;
    write_tiny_sequence(folder.path(), 110);
    for (const auto& image : images) fs::remove(folder / image);
    std::ostringstream out;
    print_inspection(out, inspect(scan_sequence(folder.path(), "auto")));
    return out.str();
  };
  CHECK_THAT(inspect_without({"image_1/000050.png", "image_0/000109.png"}),
             Catch::Contains("verdict       usable, but see the 3 warnings above") &&
                 Catch::Contains("warning       ") && Catch::Contains("image_1/000050.png: missing") &&
                 Catch::Contains("2 of 220 images cannot be read; `run` treats them as missing"));
  CHECK_THAT(inspect_without({"image_1/000050.png", "image_0/000051.png", "image_0/000052.png"}),
             Catch::Contains("not usable as a whole (3 errors)"));
  CHECK_THAT(inspect_without({"image_1/000000.png"}), Catch::Contains("not usable as a whole (1 error)"));
}

TEST_CASE("Left and right images that are the same draw a warning", "[info]") {
  const auto info = info_after([](const fs::path& folder) {
    fs::remove_all(folder / "image_1");
    fs::copy(folder / "image_0", folder / "image_1");
  });
  CHECK(info.errors == 0);
  CHECK_THAT(info.text, Catch::Contains("image_0 and image_1 show the same image"));
}

TEST_CASE("The ground truth is written for the camera or for the body", "[info]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder.path(), 2);
  for (const auto* camera : {"cam0", "cam1"})
    replace_in(folder / "mav0" / camera / "sensor.yaml", "0, 0, 1, 0, 0, 0, 0, 1]",
               "0, 0, 1, 0.25, 0, 0, 0, 1]");
  const auto sequence = open_sequence(folder.path(), "auto");
  const auto written = [&](PoseFrame frame) {
    std::ostringstream out;
    write_ground_truth(out, sequence, frame);
    return split_lines(out.str());
  };
  CHECK(written(PoseFrame::kBody)[2] == "1000000000.100000000 0.16 0 0 0 0 0 1");
  CHECK(written(PoseFrame::kCamera)[2] == "1000000000.100000000 0.16 0 0.25 0 0 0 1");
}
