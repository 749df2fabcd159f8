// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/euroc.hpp"

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// Writes a recording of four frames, breaks its mav0, and returns what opening it says.
std::string euroc_error_after(const std::function<void(const fs::path&)>& breaking) {
  const TemporaryFolder folder;
  write_tiny_euroc(folder.path(), 4);
  breaking(folder / "mav0");
  auto message = message_of([&] { (void)open_sequence(folder.path(), "auto"); });
  CHECK(std::count(message.begin(), message.end(), '\n') == 0);
  return message;
}

std::string error_with_sensor(const std::string& what, const std::string& by) {
  return euroc_error_after([&](const fs::path& mav) { replace_in(mav / "cam1/sensor.yaml", what, by); });
}

std::string error_with_rows(const std::string& rows) {
  return euroc_error_after([&](const fs::path& mav) { write_text(mav / "cam1/data.csv", rows); });
}

std::string row(int index) { return fmt::format("{0},{0}.png\n", tiny_stamp(index)); }

void delete_row(const fs::path& csv, int index) {
  replace_in(csv, fmt::format("{0},{0}.png\r\n", tiny_stamp(index)), "");
}

}  // namespace

TEST_CASE(
    "A right camera with the images of the left one is an error, although rectification moves them apart",
    "[euroc]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder.path(), 4);
  const StereoAgreement good{
      .matches = 1000, .median_disparity_px = 15.0, .near_disparity_px = 30.0, .beyond_share = 0.9};
  const auto problems = [&] {
    const auto sequence = open_sequence(folder.path(), "auto");
    return problems_of(good, sequence, {load_frame(sequence, 0)});
  };
  CHECK(problems().empty());
  fs::remove_all(folder / "mav0/cam1/data");
  fs::copy(folder / "mav0/cam0/data", folder / "mav0/cam1/data");
  REQUIRE(problems().size() == 1);
  CHECK(is_error(problems()[0]));
  CHECK_THAT(problems()[0].text, Catch::Contains("cam0 and cam1 show the same image"));
}

TEST_CASE("An EuRoC recording opens, from its folder and from mav0", "[euroc]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder.path(), 4);
  for (const auto& path : {folder.path(), folder / "mav0", folder / "mav0/"}) {
    const auto scan = scan_sequence(path, "auto");
    CHECK(scan.problems.empty());
    const auto& sequence = scan.sequence;
    CHECK(sequence.format == "euroc");
    REQUIRE(sequence.frames.size() == 4);
    CHECK(sequence.frames[1].stamp_ns == 1'000'000'000'100'000'000);
    CHECK(sequence.camera.baseline_m == Approx(0.4));
    // Parallel cameras without distortion are rectified already.
    CHECK(sequence.camera.fx == Approx(200.0).epsilon(0.01));
    CHECK(sequence.rectifier->T_left_camera().isApprox(Eigen::Isometry3d::Identity(), 1e-9));
    REQUIRE(sequence.ground_truth.size() == 4);
    CHECK(sequence.ground_truth[3].translation().x() == Approx(0.48));
    const auto frame = load_frame(sequence, 2);
    CHECK(frame.left.type() == CV_8UC1);
    CHECK(frame.left.size() == cv::Size(TinySequence::kWidth, TinySequence::kHeight));
  }
}

TEST_CASE("Rows without a partner are left out and counted", "[euroc]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder.path(), 8);
  delete_row(folder / "mav0/cam1/data.csv", 0);
  delete_row(folder / "mav0/cam1/data.csv", 3);
  delete_row(folder / "mav0/cam0/data.csv", 7);
  // A pair is less than half an interval apart.
  replace_in(folder / "mav0/cam1/data.csv", "1000000000400000000,", "1000000000402000000,");
  replace_in(folder / "mav0/cam1/data.csv", "1000000000500000000,", "1000000000560000000,");
  const auto scan = scan_sequence(folder.path(), "auto");
  std::vector<std::int64_t> stamps;
  for (const auto& frame : scan.sequence.frames)
    stamps.push_back(frame.stamp_ns % 1'000'000'000 / 100'000'000);
  CHECK(stamps == std::vector<std::int64_t>{1, 2, 4, 6});
  REQUIRE(scan.problems.size() == 3);
  for (const auto& problem : scan.problems) CHECK_FALSE(is_error(problem));
  CHECK_THAT(scan.problems[0].text, Catch::Contains("up to 2 ms apart (median 0 ms)"));
  CHECK_THAT(scan.problems[1].text, Catch::Contains("cam0/data.csv:2: 3 of 7 rows, this one first, have no "
                                                    "partner in cam1 within 50 ms"));
  CHECK_THAT(scan.problems[2].text, Catch::Contains("cam1/data.csv:5: 2 of 6 rows, this one first"));
  const auto strict = scan_sequence(folder.path(), "auto", {}, {.most_apart_ns = 1'000'000});
  CHECK(strict.sequence.frames.size() == 3);
  CHECK(strict.sequence.pair_distances.largest_ns == 0);
}

TEST_CASE("A damaged data.csv is refused with file and line", "[euroc]") {
  const std::string two = row(0) + row(1);
  CHECK_THAT(euroc_error_after([](const fs::path& mav) { fs::remove(mav / "cam0/data.csv"); }),
             Catch::Contains("cam0/data.csv: missing"));
  CHECK_THAT(error_with_rows("#timestamp [ns],filename\n"),
             Catch::Contains("cam1/data.csv: lists no images"));
  CHECK_THAT(error_with_rows(two + "noon,noon.png\n"),
             Catch::Contains("cam1/data.csv:3: 'noon' is not a stamp in nanoseconds"));
  CHECK_THAT(error_with_rows(two + "1.5,a.png\n"), Catch::Contains("cam1/data.csv:3: '1.5' is not a stamp"));
  CHECK_THAT(error_with_rows(two + "-5,a.png\n"), Catch::Contains("cam1/data.csv:3: '-5' is not a stamp"));
  CHECK_THAT(error_with_rows(two + "99999999999999999999,a.png\n"),
             Catch::Contains("cam1/data.csv:3: '9999"));
  CHECK_THAT(error_with_rows(two + row(1)),
             Catch::Contains("cam1/data.csv:3: stamp 1000000000100000000 occurs twice"));
  CHECK_THAT(error_with_rows(row(1) + row(0)),
             Catch::Contains("cam1/data.csv:2: stamp 1000000000000000000 is earlier"));
  // Cut off within the stamp, after it, and within the name.
  CHECK_THAT(error_with_rows(two + "10000000"),
             Catch::Contains("cam1/data.csv:3: ") && Catch::Contains("truncated"));
  CHECK_THAT(error_with_rows(two + "1000000000200000000,"), Catch::Contains("cam1/data.csv:3: "));
  CHECK_THAT(error_with_rows("5,5.png\n9,9.png\n"),
             Catch::Contains(": 0 of 4 images of cam0 and 2 of cam1 were taken within"));
  CHECK_THAT(error_with_rows(row(2)), Catch::Contains("contains a single frame"));
}

TEST_CASE("Other columns, paths and headings of data.csv are read", "[euroc]") {
  const auto frames_with = [](const std::function<std::string(int)>& row_of) {
    const TemporaryFolder folder;
    write_tiny_euroc(folder.path(), 4);
    for (const auto* camera : {"cam0", "cam1"}) {
      std::string rows;
      for (int i = 0; i < 4; ++i) rows += row_of(i);
      write_text(folder / "mav0" / camera / "data.csv", rows);
    }
    const auto sequence = open_sequence(folder.path(), "auto");
    REQUIRE(sequence.frames.size() == 4);
    for (int i = 0; i < 4; ++i) {
      const auto& frame = sequence.frames[static_cast<std::size_t>(i)];
      CHECK(frame.stamp_ns == std::stoll(tiny_stamp(i)));
      CHECK(frame.right.stem() == tiny_stamp(i));
      CHECK(load_frame(sequence, static_cast<std::size_t>(i)).left.cols == TinySequence::kWidth);
    }
  };
  frames_with([](int i) { return fmt::format("{0},{0}.png,1200000,4.5\n", tiny_stamp(i)); });
  frames_with([](int i) { return fmt::format("{0}, 3, {1}, {0}.png\n", tiny_stamp(i), i); });
  frames_with([](int i) { return fmt::format("{0},data/{0}.png\r\n", tiny_stamp(i)); });
  frames_with([](int i) { return fmt::format("{0} ./data/{0}.png\n", tiny_stamp(i)); });
  frames_with([](int i) { return fmt::format("{0};{0}.png\n", tiny_stamp(i)); });
  frames_with([](int i) { return fmt::format("1000000000,{1}00000000;{0}.png\n", tiny_stamp(i), i); });
  frames_with([](int i) { return fmt::format("{0},data\\{0}.png\n", tiny_stamp(i)); });
  frames_with([](int i) { return fmt::format("{0},/home/me/cam9/data/{0}.png\n", tiny_stamp(i)); });
  frames_with(
      [](int i) { return fmt::format("{1}{0},{0}.png\n", tiny_stamp(i), i == 0 ? "timestamp,name\n" : ""); });
}

TEST_CASE("Stamps of data.csv in another unit are read in it", "[euroc]") {
  const auto stamps_with = [](const std::function<std::string(int)>& stamp_of) {
    const TemporaryFolder folder;
    write_tiny_euroc(folder.path(), 4);
    for (const auto* camera : {"cam0", "cam1"}) {
      std::string rows = "#timestamp [ns],filename\n";
      for (int i = 0; i < 4; ++i) rows += fmt::format("{},{}.png\n", stamp_of(i), tiny_stamp(i));
      write_text(folder / "mav0" / camera / "data.csv", rows);
    }
    const auto sequence = open_sequence(folder.path(), "auto");
    std::vector<std::int64_t> stamps_ns;
    for (const auto& frame : sequence.frames) stamps_ns.push_back(frame.stamp_ns);
    return stamps_ns;
  };
  std::vector<std::int64_t> expected;
  expected.reserve(4);
  for (int i = 0; i < 4; ++i) expected.push_back(std::stoll(tiny_stamp(i)));
  CHECK(stamps_with([](int i) { return fmt::format("1000000000.{}", i); }) == expected);
  CHECK(stamps_with([](int i) { return fmt::format("1000000000.{}00000000", i); }) == expected);
  CHECK(stamps_with([](int i) { return fmt::format("1000000000{}00", i); }) == expected);
  CHECK(stamps_with([](int i) { return fmt::format("1000000000{}00000", i); }) == expected);
}

TEST_CASE("An image that data.csv lists and that is missing keeps its frame", "[euroc]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder.path(), 4);
  const auto right = "cam1/data/" + tiny_stamp(2) + ".png";
  fs::remove(folder / "mav0" / right);
  const std::string rows = read_text(folder / "mav0/cam0/data.csv");
  write_text(folder / "mav0/cam0/data.csv", rows.substr(0, rows.size() - 8));  // within the last name
  const auto sequence = open_sequence(folder.path(), "auto");
  REQUIRE(sequence.frames.size() == 4);
  CHECK_THAT(message_of([&] { (void)load_frame(sequence, 2); }), Catch::Contains(right + ": missing"));
  const auto frame = load_partial_frame(sequence, 2);
  CHECK(frame.has_left());
  CHECK_THAT(frame.right_fault, Catch::Contains(right + ": missing"));
  CHECK_FALSE(load_partial_frame(sequence, 3).has_left());
}

TEST_CASE("A EuRoC folder without its first image, or without a camera, is refused", "[euroc]") {
  CHECK_THAT(euroc_error_after([&](const fs::path& mav) { fs::remove_all(mav / "cam0/data"); }),
             Catch::Contains("cam0/data/" + tiny_stamp(0) + ".png: missing"));
  CHECK_THAT(euroc_error_after([&](const fs::path& mav) { fs::remove_all(mav / "cam1"); }),
             Catch::Contains("has no cam0 and cam1"));
  CHECK_THAT(euroc_error_after([&](const fs::path& mav) {
               truncate_file(mav / "cam0/data" / (tiny_stamp(0) + ".png"), 0.5);
             }),
             Catch::Contains("truncated"));
}

TEST_CASE("A wrong sensor.yaml is refused with file and line", "[euroc]") {
  CHECK_THAT(euroc_error_after([](const fs::path& mav) { fs::remove(mav / "cam1/sensor.yaml"); }),
             Catch::Contains("cam1/sensor.yaml: missing"));
  CHECK_THAT(error_with_sensor("[200, 200,", "[nan, 200,"),
             Catch::Contains("cam1/sensor.yaml:10: intrinsics holds 'nan', which is not a finite number"));
  CHECK_THAT(error_with_sensor("[200, 200,", "[.inf, 200,"), Catch::Contains("sensor.yaml:10: intrinsics"));
  CHECK_THAT(error_with_sensor("[200, 200,", "[200,"),
             Catch::Contains("sensor.yaml:10: intrinsics has 3 numbers"));
  CHECK_THAT(error_with_sensor("[200, 200,", "[0, 200,"), Catch::Contains("both must be positive"));
  CHECK_THAT(error_with_sensor("160, 60]", "160, 600]"),
             Catch::Contains("the principal point (160, 600) lies outside"));
  CHECK_THAT(error_with_sensor("radial-tangential", "omni"),
             Catch::Contains("sensor.yaml:11: distortion_model is omni, but must be radtan"));
  CHECK_THAT(error_with_sensor("pinhole", "ds"), Catch::Contains("sensor.yaml:9: camera_model is ds"));
  CHECK_THAT(error_with_sensor("[0, 0, 0, 0]", "[0, 0]"),
             Catch::Contains("sensor.yaml:12: radtan has 2 distortion coefficients, but needs 4, 5 or 8"));
  CHECK_THAT(error_with_sensor("0, 0, 1, 0, 0, 0, 0, 1]", "0, 0, 1, 0]"),
             Catch::Contains("T_BS has 12 numbers, but a 4x4 matrix has 16"));
  CHECK_THAT(error_with_sensor("[1, 0, 0,", "[2, 0, 0,"), Catch::Contains("T_BS is not a rigid motion"));
  CHECK_THAT(error_with_sensor("[1, 0, 0,", "[x, 0, 0,"), Catch::Contains("sensor.yaml:6: T_BS holds 'x'"));
  CHECK_THAT(error_with_sensor("T_BS", "T_SB"),
             Catch::Contains("cam1/sensor.yaml") && Catch::Contains("no T_BS"));
  CHECK_THAT(error_with_sensor("resolution: [320, 120]", "resolution: [300, 100]"),
             Catch::Contains(".png: is 320x120 pixels, but the resolution of the calibration is 300x100"));
  CHECK_THAT(error_with_sensor("resolution: [320, 120]", "resolution: [320]"),
             Catch::Contains("must be [width, height]"));
  CHECK_THAT(error_with_sensor("resolution: [320, 120]", "resolution: 320"),
             Catch::Contains("must be a list of numbers"));
  CHECK_THAT(error_with_sensor("resolution:", "size:"), Catch::Contains("has no resolution; add it"));
  CHECK_THAT(error_with_sensor("intrinsics: [", "intrinsics: [["), Catch::Contains("not valid YAML"));
  CHECK_THAT(euroc_error_after([](const fs::path& mav) { write_text(mav / "cam0/sensor.yaml", ""); }),
             Catch::Contains("cam0/sensor.yaml:1: "));
}

TEST_CASE("Cameras that cannot be rectified are refused", "[euroc]") {
  const std::string place = "[1, 0, 0, 0.4, 0, 1, 0, 0,";
  CHECK_THAT(error_with_sensor(place, "[1, 0, 0, 0, 0, 1, 0, 0,"), Catch::Contains("at the same place"));
  CHECK_THAT(error_with_sensor(place, "[1, 0, 0, -0.4, 0, 1, 0, 0,"),
             Catch::Contains("the transformation between the cameras looks inverted"));
  CHECK_THAT(error_with_sensor(place, "[1, 0, 0, 0, 0, 1, 0, 0.4,"),
             Catch::Contains("only horizontal stereo pairs"));
  CHECK_THAT(error_with_sensor("[1, 0, 0, 0.4, 0, 1, 0, 0,", "[0, -1, 0, 0.4, 1, 0, 0, 0,"),
             Catch::Contains("turned by 90 degrees"));
  CHECK_THAT(error_with_sensor("radial-tangential", "equidistant"),
             Catch::Contains("one camera is a fisheye"));
  // A distortion that no lens has must end in an error or in a camera, not in a crash.
  const std::string wild = error_with_sensor("[0, 0, 0, 0]", "[-1e6, 1e9, 3, -7]");
  if (!wild.empty()) CHECK_THAT(wild, Catch::Contains("focal lengths of"));
}

TEST_CASE("Images of another size than the calibration's are refused", "[euroc]") {
  const auto first = "data/" + tiny_stamp(0) + ".png";
  CHECK_THAT(
      euroc_error_after([&](const fs::path& mav) {
        for (const auto* camera : {"cam0", "cam1"})
          replace_in(mav / camera / "sensor.yaml", "resolution: [320, 120]", "resolution: [640, 240]");
      }),
      Catch::Contains(first + ": is 320x120 pixels, but the resolution of the calibration is 640x240"));
}

TEST_CASE("TUM-VI's form is read: 16 bits, fisheye, Kalibr's camchain", "[euroc]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder.path(), 3);
  const auto mav = folder / "mav0";
  for (const auto* camera : {"cam0", "cam1"}) fs::remove(mav / camera / "sensor.yaml");
  fs::create_directories(folder / "dso");
  const auto chain = [](const char* name, double x_m, const std::string& more) {
    return fmt::format(
        "{}:\n  T_cam_imu:\n  - [1, 0, 0, {}]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0.0, 0.0, 0.0, "
        "1.0]\n{}"
        "  camera_model: pinhole\n  distortion_coeffs: [0.003, 0.0007, -0.0002, 0.0002]\n"
        "  distortion_model: equidistant\n  intrinsics: [200, 200, 160, 60]\n  resolution: [320, 120]\n",
        name, -x_m, more);
  };
  write_text(folder / "dso/camchain.yaml", chain("cam0", 0.0, "") + chain("cam1", 0.4, ""));
  const auto eight_bits = load_frame(open_sequence(folder.path(), "auto"), 1);
  const auto file = (mav / "cam0/data" / (tiny_stamp(1) + ".png")).string();
  cv::Mat deep;
  cv::imread(file, cv::IMREAD_GRAYSCALE).convertTo(deep, CV_16U, 256.0, 77.0);
  cv::imwrite(file, deep);
  fs::rename(mav / "state_groundtruth_estimate0", mav / "mocap0");

  const auto sequence = open_sequence(folder.path(), "auto");
  CHECK(sequence.lenses == "equidistant");
  CHECK(sequence.camera.baseline_m == Approx(0.4));
  CHECK(sequence.ground_truth.size() == 3);
  CHECK(cv::norm(load_frame(sequence, 1).left, eight_bits.left, cv::NORM_INF) == 0.0);

  // Without the body, the pose of the right camera in the left one is enough.
  std::string alone =
      chain("cam0", 0.0, "") +
      chain("cam1", 0.4, "  T_cn_cnm1: [[1, 0, 0, -0.4], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n");
  write_text(folder / "dso/camchain.yaml", alone);
  for (int i = 0; i < 2; ++i) replace_in(folder / "dso/camchain.yaml", "T_cam_imu", "ignored");
  const auto scan = scan_sequence(folder.path(), "auto");
  CHECK(scan.sequence.camera.baseline_m == Approx(0.4));
  CHECK_FALSE(scan.sequence.T_body_camera);
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(scan.problems[0].text, Catch::Contains("mocap0/data.csv") && Catch::Contains("without T_BS"));
}
