// SPDX-License-Identifier: MIT
// Recordings of other layouts than KITTI's, from the command line.
#include "stereo_slam/support/program.hpp"
#include "stereo_slam/support/tiny_video.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("Broken EuRoC recordings and own cameras give one line and status 1, from run and from info",
          "[cli]") {
  const auto sensor = [](const char* what, const char* by) {
    return [=](const fs::path& f) { replace_in(f / "mav0/cam1/sensor.yaml", what, by); };
  };
  const auto image = [](const fs::path& f, int i) { return f / "mav0/cam1/data" / (tiny_stamp(i) + ".png"); };
  const auto own = [](const std::string& left) {
    return [=](const fs::path& f) {
      fs::remove_all(f / "mav0");
      write_tiny_folders(f, 3);
      write_text(f / "calibration.yaml",
                 tiny_calibration("frame_rate_hz: 10\nleft: {source: " + left + "}\n"));
      write_text(f / "noise.mp4", "no video");
    };
  };
  const std::vector<Breaking> cases = {
      {"cam1/data/1000000000200000000.png: missing", [&](const fs::path& f) { fs::remove(image(f, 2)); }},
      {"the PNG is truncated", [&](const fs::path& f) { truncate_file(image(f, 3), 0.5); }},
      {"is 200x120 pixels", [&](const fs::path& f) { cv::imwrite(image(f, 3).string(), tiny_texture(200)); }},
      {"cam0/data.csv: lists no images", [](const fs::path& f) { write_text(f / "mav0/cam0/data.csv", ""); }},
      {"intrinsics holds 'nan'", sensor("[200, 200,", "[nan, 200,")},
      {"distortion_model is cubic", sensor("radial-tangential", "cubic")},
      {"T_BS has 12 numbers", sensor("0, 0, 1, 0, 0, 0, 0, 1]", "0, 0, 1, 0]")},
      {"resolution of the calibration is 300x100", sensor("[320, 120]", "[300, 100]")},
      {"noise.mp4: cannot be opened as a video", own("noise.mp4")},
      {"nowhere: neither a folder", own("nowhere")},
      {"left/1.pgm: the image cannot be decoded",
       [&](const fs::path& f) {
         own("left")(f);
         for (const auto* side : {"left", "right"}) {
           for (int i = 0; i < 3; ++i) {
             const auto png = f / side / frame_name(i);
             cv::imwrite((f / side / fmt::format("{}.pgm", i)).string(),
                         cv::imread(png.string(), cv::IMREAD_GRAYSCALE));
             fs::remove(png);
           }
         }
         truncate_file(f / "left/1.pgm", 0.5);
       }},
  };
  check_refused(write_tiny_euroc, cases);
}

TEST_CASE("A list of images that was cut off loses what is cut off", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder / "in", 5);
  truncate_file(folder / "in/mav0/cam1/data.csv", 0.8);  // in the middle of the fourth name
  const auto info = call({"info", "--dataset", folder / "in"});
  CHECK(info.status == 1);
  CHECK_THAT(info.out, Catch::Contains("cam1/data/1000000000300000000.: missing"));
  const auto run = call({"run", "--dataset", folder / "in", "--output", folder / "out"});
  CHECK(run.status == 0);
  CHECK_THAT(run.err, Catch::Contains("cam1/data/1000000000300000000.: missing"));
}

TEST_CASE("run and info warn of rows without a partner", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder / "in", 5);
  replace_in(folder / "in/mav0/cam1/data.csv", tiny_stamp(1) + ",", "1000000000150000000,");
  const auto info = call({"info", "--dataset", folder / "in"});
  CHECK(info.status == 0);
  CHECK_THAT(info.out, Catch::Contains("frames        4") && Catch::Contains("data.csv:3: 1 of 5 rows"));
  const auto run = call({"run", "--dataset", folder / "in", "--output", folder / "out"});
  CHECK(run.status == 0);
  CHECK(split_lines(run.err).size() == 2);
  CHECK_THAT(run.err,
             Catch::Contains("cam0/data.csv:3: 1 of 5 rows") && Catch::Contains("cam1/data.csv:3: 1 of 5"));
}

TEST_CASE("run warns once of a video that ends before its header says", "[cli][video]") {
  const TemporaryFolder folder;
  write_tiny_video(folder / "in", 12, 12);
  for (const auto* name : {"left.avi", "right.avi"}) promise_frames(folder / "in" / name, 15);
  const auto run = call({"run", "--dataset", folder / "in", "--output", folder / "out"});
  CHECK(run.status == 0);
  CHECK(split_lines(run.err).size() == 1);
  CHECK_THAT(run.err, Catch::Contains("warning: ") &&
                          Catch::Contains("the video ends after 12 frames, its header promises 15"));
  CHECK(call({"run", "--dataset", folder / "in", "--output", folder / "out2", "--quiet"}).err.empty());
}

TEST_CASE("info says how many frames of a video it has read", "[cli][video]") {
  const TemporaryFolder folder;
  write_tiny_video(folder / "in", 12, 12);
  const auto info = call({"info", "--dataset", folder / "in"});
  CHECK(info.status == 0);
  CHECK_THAT(info.out, Catch::Contains("those of the first 5 of 12 frames"));
}

TEST_CASE("run and info warn of a calibration that does not rectify the images; run learns it", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder / "in", 3);
  replace_in(folder / "in/mav0/cam1/sensor.yaml", "0, 1, 0, 0,\n    0, 0, 1, 0",
             "0, 0.99985, -0.01745, 0,\n    0, 0.01745, 0.99985, 0");  // a degree about x
  const auto info = call({"info", "--dataset", folder / "in"});
  CHECK(info.status == 0);
  CHECK_THAT(info.out, Catch::Contains("warning") && Catch::Contains("the images look rectified already"));
  const auto run = call({"run", "--dataset", folder / "in", "--output", folder / "out"});
  CHECK(run.status == 0);
  const auto messages = split_lines(run.err);
  REQUIRE(messages.size() == 1);
  CHECK_THAT(messages[0], Catch::Contains("the images look rectified already"));
  const auto statuses = read_text(folder / "out/covariances.csv");
  CHECK_THAT(statuses, Catch::Contains(",OK,") && !Catch::Contains(",LOST,"));
}

TEST_CASE("simulate, info, run and evaluate work together on an EuRoC recording", "[cli]") {
  const TemporaryFolder folder;
  const auto simulated = call({"simulate", "--output", folder / "s", "--format", "euroc", "--distortion",
                               "equidistant", "--frames", "4", "--scale", "0.4", "--quiet"});
  CHECK(simulated.err.empty());
  CHECK(simulated.status == 0);
  const auto info = call({"info", "--dataset", folder / "s", "--write-groundtruth", folder / "truth.txt"});
  CHECK(info.status == 0);
  CHECK_THAT(info.out, Catch::Contains("format        euroc") && Catch::Contains("from equidistant lenses") &&
                           Catch::Contains("row offset 0.") && Catch::Contains("verdict       usable"));
  for (const auto* frame : {"camera", "body"}) {
    const auto run = call({"run", "--dataset", folder / "s/mav0", "--output", folder / "o", "--quiet",
                           "--overwrite", "--clahe", "--pose-frame", frame});
    CHECK(run.err.empty());
    CHECK(run.status == 0);
    CHECK_THAT(read_text(folder / "o/run.yaml"),
               Catch::Contains(fmt::format("pose_frame: {}", frame)) && Catch::Contains("clahe: true"));
    const auto truth = std::string(frame) == "camera"
                           ? folder / "truth.txt"
                           : folder / "s/mav0/state_groundtruth_estimate0/data.csv";
    const auto evaluate =
        call({"evaluate", "--groundtruth", truth, "--estimate", folder / "o/trajectory_tum.txt"});
    CHECK(evaluate.status == 0);
    CHECK_THAT(evaluate.out, Catch::Contains("frames matched                  4"));
  }
}

TEST_CASE("run searches the disparities of points that are nearer than usual", "[cli]") {
  constexpr int kDisparity_px = 190;  // more than the 160 px of the preset
  constexpr int kWidth = 480;
  constexpr int kFrames = 5;
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", kFrames);
  write_text(folder / "in/calib.txt",
             "P0: 200 0 240 0 0 200 60 0 0 0 1 0\nP1: 200 0 240 -80 0 200 60 0 0 0 1 0\n");
  const cv::Mat texture = tiny_texture(kWidth + kDisparity_px + TinySequence::kShift_px * kFrames);
  for (int i = 0; i < kFrames; ++i) {
    const cv::Rect left(TinySequence::kShift_px * i, 0, kWidth, TinySequence::kHeight);
    cv::imwrite((folder / "in/image_0" / frame_name(i)).string(), texture(left));
    cv::imwrite((folder / "in/image_1" / frame_name(i)).string(),
                texture(left + cv::Point(kDisparity_px, 0)));
  }
  const auto run = call({"run", "--dataset", folder / "in", "--output", folder / "out"});
  CHECK(run.status == 0);
  REQUIRE(split_lines(run.err).size() == 1);
  CHECK_THAT(run.err, Catch::Contains("stereo.max_disparity_px is raised from 160 to 285"));
  CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("max_disparity_px: 285"));
  CHECK_THAT(read_text(folder / "out/covariances.csv"), !Catch::Contains(",LOST,"));

  const auto info = call({"info", "--dataset", folder / "in"});
  CHECK_THAT(info.out, Catch::Contains(
                           "disparities above 190 px; `run` raises stereo.max_disparity_px from 160 to 285"));

  write_text(folder / "range.yaml", "stereo: {max_disparity_px: 170}\n");
  const auto set = call(
      {"run", "--dataset", folder / "in", "--output", folder / "out2", "--config", folder / "range.yaml"});
  CHECK_THAT(set.err,
             Catch::Contains("above 190 px, beyond stereo.max_disparity_px, which is 170; set it to 285"));
}
