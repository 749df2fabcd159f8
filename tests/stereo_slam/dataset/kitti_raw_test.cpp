// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/kitti_raw.hpp"

#include <cmath>
#include <numbers>

#include "stereo_slam/dataset/kitti_oxts.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// A drive of the tiny recording; its cameras look along the x axis of the IMU.
class TinyDrive {
 public:
  static constexpr double kStep_m = 1.0;  ///< a frame, to the east

  TinyDrive(int frames, bool raw, const std::string& left = "00", const std::string& right = "01") {
    write_tiny_sequence(day_ / "odometry", frames);
    write_camera("image_0", left, frames);
    write_camera("image_1", right, frames);
    fs::remove_all(day_ / "odometry");
    const std::string size = "3.200000e+02 1.200000e+02\n";
    const std::string other = "3.300000e+02 1.300000e+02\n";
    std::string text = "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.950000e-02\n";
    for (const auto& [camera, x_m] : {std::pair{left, 0.06}, {right, 0.06 - TinySequence::kBaseline_m}}) {
      text += fmt::format("S_{0}: {1}K_{0}: 200 0 160 0 200 60 0 0 1\nD_{0}: 0 0 0 0 0\n", camera,
                          raw ? size : other);
      text += fmt::format("R_{0}: 1 0 0 0 1 0 0 0 1\nT_{0}: {1} 0 0\nS_rect_{0}: {2}", camera, x_m,
                          raw ? other : size);
      text += fmt::format("P_rect_{0}: 200 0 160 {1} 0 200 60 0.2 0 0 1 0.003\n", camera, 200.0 * x_m);
    }
    write_text(day_ / "calib_cam_to_cam.txt", text + "R_rect_00: 1 0 0 0 1 0 0 0 1\n");
    write_text(day_ / "calib_imu_to_velo.txt", "calib_time: x\nR: 1 0 0 0 1 0 0 0 1\nT: 0 0 0\n");
    write_text(day_ / "calib_velo_to_cam.txt", "R: 0 -1 0 0 0 -1 1 0 0\nT: 0 0 0\ndelta_f: 0 0\n");
    write_oxts(frames);
  }

  [[nodiscard]] fs::path day() const { return day_.path(); }
  [[nodiscard]] fs::path drive() const { return day_ / "2011_09_26_drive_0001_sync"; }
  [[nodiscard]] SequenceScan scan() const { return scan_sequence(drive(), "auto"); }
  [[nodiscard]] std::string error() const {
    return message_of([&] { (void)open_sequence(drive(), "auto"); });
  }

  static std::string image(int index) { return fmt::format("{:010}.png", index); }

  /// "2011-09-26 13:02:25.900000000", and 0.1 s later with each frame.
  static std::string date(int index, int late_ms = 0) {
    const int ms = 25'900 + 100 * index + late_ms;
    return fmt::format("2011-09-26 13:02:{:02}.{:03}000000\n", ms / 1000, ms % 1000);
  }

 private:
  void write_camera(const std::string& from, const std::string& number, int frames) const {
    const fs::path camera = drive() / ("image_" + number);
    fs::create_directories(camera / "data");
    std::string times;
    for (int i = 0; i < frames; ++i) {
      fs::rename(day_ / "odometry" / from / frame_name(i), camera / "data" / image(i));
      times += date(i);
    }
    write_text(camera / "timestamps.txt", times);
  }

  void write_oxts(int frames) const {
    constexpr double kLatitude_deg = 49.0;
    const double degrees_of_step =
        kStep_m / (6378137.0 * std::cos(kLatitude_deg * std::numbers::pi / 180.0)) * 180.0 / std::numbers::pi;
    fs::create_directories(drive() / "oxts/data");
    std::string times;
    for (int i = 0; i < frames; ++i) {
      write_text(drive() / "oxts/data" / fmt::format("{:010}.txt", i),
                 fmt::format("{} {:.17g} 112.5 0 0 0 13.17 -0.12 0 0 0\n", kLatitude_deg,
                             8.4 + degrees_of_step * i));
      times += date(i, 3);
    }
    write_text(drive() / "oxts/timestamps.txt", times);
  }

  TemporaryFolder day_;
};

/// The camera moves forwards, along its z axis.
void check_truth(const StereoSequence& sequence, std::size_t poses) {
  REQUIRE(sequence.ground_truth.size() == poses);
  CHECK(sequence.ground_truth_ns[0] - sequence.frames[0].stamp_ns == 3'000'000);
  const Eigen::Isometry3d T = sequence.ground_truth[0].inverse() * sequence.ground_truth[2];
  // The Mercator projection of 49 degrees, in double precision: 1e7 m with 16 digits.
  CHECK((T.translation() - Eigen::Vector3d(0.0, 0.0, 2.0 * TinyDrive::kStep_m)).norm() < 1e-8);
  CHECK(T.linear().isIdentity(1e-12));
}

}  // namespace

TEST_CASE("A synchronised drive of KITTI's raw data opens, with the poses of its camera", "[kitti]") {
  const TinyDrive drive(4, /*raw=*/false);
  for (const auto& folder : {drive.drive(), drive.drive() / "", drive.day()}) {
    const auto scan = scan_sequence(folder, "auto");
    CHECK(scan.problems.empty());
    const auto& sequence = scan.sequence;
    CHECK(sequence.format == "kitti");
    REQUIRE(sequence.frames.size() == 4);
    CHECK(sequence.frames[0].stamp_ns == 1'317'042'145'900'000'000);
    CHECK(sequence.frames[3].stamp_ns - sequence.frames[0].stamp_ns == 300'000'000);
    CHECK(sequence.camera.baseline_m == Approx(TinySequence::kBaseline_m));
    CHECK_FALSE(sequence.rectifier);
    CHECK(load_frame(sequence, 3).right.cols == TinySequence::kWidth);
    check_truth(sequence, 4);
  }
}

TEST_CASE("An extracted drive of KITTI's raw data is rectified", "[kitti]") {
  const TinyDrive drive(4, /*raw=*/true);
  const auto scan = drive.scan();
  CHECK(scan.problems.empty());
  REQUIRE(scan.sequence.rectifier);
  CHECK(scan.sequence.lenses == "radtan");
  CHECK(scan.sequence.camera.baseline_m == Approx(TinySequence::kBaseline_m));
  CHECK(scan.sequence.frames.size() == 4);
  check_truth(scan.sequence, 4);
}

TEST_CASE("The colour cameras of a drive are used where the grey ones are missing", "[kitti]") {
  const TinyDrive drive(3, /*raw=*/false, "02", "03");
  const auto scan = drive.scan();
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.left_name == "image_02");
  CHECK(scan.sequence.frames.size() == 3);
}

TEST_CASE("Images of an extracted drive are paired by stamp, whatever their numbers", "[kitti]") {
  const TinyDrive drive(6, /*raw=*/true);
  // The right camera lost image 1, so its later images have other numbers; the last one has no time.
  const fs::path right = drive.drive() / "image_01";
  for (int i = 1; i < 5; ++i)
    fs::rename(right / "data" / TinyDrive::image(i + 1), right / "data" / TinyDrive::image(i));
  std::string times;
  for (const int i : {0, 2, 3, 4}) times += TinyDrive::date(i, 5);
  write_text(right / "timestamps.txt", times + "\n");
  const auto scan = drive.scan();
  const auto& frames = scan.sequence.frames;
  REQUIRE(frames.size() == 4);
  CHECK(frames[1].left.filename() == TinyDrive::image(2));
  CHECK(frames[1].right.filename() == TinyDrive::image(1));
  CHECK(scan.sequence.pair_distances.median_ns == 5'000'000);
  REQUIRE(scan.problems.size() == 3);
  for (const auto& problem : scan.problems) CHECK_FALSE(is_error(problem));
  CHECK_THAT(scan.problems[0].text, Catch::Contains("image_01: 1 image has no line in timestamps.txt"));
  CHECK_THAT(scan.problems[1].text, Catch::Contains("up to 5 ms apart"));
  CHECK_THAT(scan.problems[2].text, Catch::Contains("2 images have no partner"));
}

TEST_CASE("Images of a synchronised drive are paired by number", "[kitti]") {
  const TinyDrive drive(5, /*raw=*/false);
  fs::remove(drive.drive() / "image_00/data" / TinyDrive::image(1));
  fs::remove(drive.drive() / "image_01/data" / TinyDrive::image(3));
  const auto scan = drive.scan();
  REQUIRE(scan.sequence.frames.size() == 3);
  CHECK(scan.sequence.frames[1].right.filename() == TinyDrive::image(2));
  CHECK(scan.sequence.frames[1].stamp_ns - scan.sequence.frames[0].stamp_ns == 200'000'000);
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(scan.problems[0].text, Catch::Contains("2 images have no partner"));
}

TEST_CASE("A drive without the calibration of its IMU has no ground truth, and a warning says why",
          "[kitti]") {
  const TinyDrive drive(3, /*raw=*/false);
  fs::remove(drive.day() / "calib_imu_to_velo.txt");
  const auto scan = drive.scan();
  CHECK(scan.sequence.ground_truth.empty());
  REQUIRE(scan.problems.size() == 1);
  CHECK_FALSE(is_error(scan.problems[0]));
  CHECK_THAT(scan.problems[0].text, Catch::Contains("no calib_imu_to_velo.txt in the drive or beside it"));
  fs::remove_all(drive.drive() / "oxts");
  CHECK(drive.scan().problems.empty());
}

TEST_CASE("Packets of a drive that are not later than those before them are left out", "[kitti]") {
  const TinyDrive drive(4, /*raw=*/false);
  write_text(drive.drive() / "oxts/timestamps.txt",
             TinyDrive::date(0, 3) + TinyDrive::date(1, 3) + TinyDrive::date(0, 90) + TinyDrive::date(3, 3));
  const auto scan = drive.scan();
  CHECK(scan.sequence.ground_truth.size() == 3);
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(scan.problems[0].text, Catch::Contains("1 packets are not later"));
}

namespace {

/// A drive of KITTI-360: the tiny one in the folders of that data set.
class Tiny360 {
 public:
  explicit Tiny360(int frames) {
    const TinyDrive kitti(frames, /*raw=*/false);
    fs::create_directories(drive().parent_path());
    fs::copy(kitti.drive(), drive(), fs::copy_options::recursive);
    fs::remove_all(drive() / "oxts");
    for (const auto* camera : {"image_00", "image_01"})
      fs::rename(drive() / camera / "data", drive() / camera / "data_rect");
    fs::create_directories(drive() / "image_02/data_rgb");
    fs::create_directories(calibration());
    fs::copy_file(kitti.day() / "calib_cam_to_cam.txt", calibration() / "perspective.txt");
    write_text(calibration() / "calib_cam_to_pose.txt", "image_00: 0 0 1 2 -1 0 0 0 0 -1 0 0\n");
    fs::create_directories(poses().parent_path());
    std::string text;  // IMU to world; the first frame has none
    for (int i = 1; i < frames; ++i) text += fmt::format("{} 1 0 0 {} 0 1 0 700 0 0 1 0\n", i, 500.0 + i);
    write_text(poses(), text);
  }

  [[nodiscard]] fs::path root() const { return root_.path(); }
  [[nodiscard]] fs::path drive() const { return root_ / "data_2d_raw/2013_05_28_drive_0003_sync"; }
  [[nodiscard]] fs::path calibration() const { return root_ / "calibration"; }
  [[nodiscard]] fs::path poses() const { return root_ / "data_poses/2013_05_28_drive_0003_sync/poses.txt"; }

 private:
  TemporaryFolder root_;
};

}  // namespace

TEST_CASE("A drive of KITTI-360 opens, with the poses of its camera", "[kitti]") {
  const Tiny360 drive(4);
  for (const auto& folder : {drive.drive(), drive.drive() / "", drive.drive().parent_path()}) {
    const auto scan = scan_sequence(folder, "auto");
    CHECK(scan.problems.empty());
    const auto& sequence = scan.sequence;
    CHECK(sequence.format == "kitti");
    REQUIRE(sequence.frames.size() == 4);
    CHECK(sequence.frames[3].stamp_ns - sequence.frames[0].stamp_ns == 300'000'000);
    CHECK(sequence.camera.baseline_m == Approx(TinySequence::kBaseline_m));
    CHECK_FALSE(sequence.rectifier);
    CHECK(load_frame(sequence, 3).right.cols == TinySequence::kWidth);
    REQUIRE(sequence.ground_truth.size() == 3);
    CHECK(sequence.ground_truth_ns[0] == sequence.frames[1].stamp_ns);
    // 2 m before the IMU, and .06 m beside camera 0 by P_rect_00.
    const Eigen::Vector3d centre = sequence.ground_truth[0].translation();
    CHECK((centre - Eigen::Vector3d(503.0, 700.06, 0.0)).norm() < 1e-2);
    const Eigen::Isometry3d T = sequence.ground_truth[0].inverse() * sequence.ground_truth[2];
    CHECK((T.translation() - Eigen::Vector3d(0.0, 0.0, 2.0)).norm() < 1e-9);
  }
}

TEST_CASE("What a drive of KITTI-360 lacks is named", "[kitti]") {
  const Tiny360 drive(3);
  fs::remove(drive.calibration() / "calib_cam_to_pose.txt");
  const auto warned = scan_sequence(drive.drive(), "auto");
  REQUIRE(warned.problems.size() == 1);
  CHECK_FALSE(is_error(warned.problems[0]));
  CHECK_THAT(warned.problems[0].text, Catch::Contains("there is no calib_cam_to_pose.txt"));
  fs::remove(drive.poses());
  CHECK(scan_sequence(drive.drive(), "auto").problems.empty());
  fs::rename(drive.calibration() / "perspective.txt", drive.drive() / "perspective.txt");
  CHECK(scan_sequence(drive.drive(), "auto").problems.empty());
  fs::remove(drive.drive() / "perspective.txt");
  CHECK_THAT(message_of([&] { (void)open_sequence(drive.drive(), "auto"); }),
             Catch::Contains("there is no perspective.txt in the drive, beside it or in 'calibration'"));
  CHECK_THAT(message_of([&] { (void)open_sequence(drive.root(), "auto"); }),
             Catch::Contains("the recording may be") && Catch::Contains("data_2d_raw"));
}

TEST_CASE("A damaged drive is refused with the file", "[kitti]") {
  const auto error_after = [](const std::function<void(const TinyDrive&)>& breaking) {
    const TinyDrive drive(3, /*raw=*/false);
    breaking(drive);
    return drive.error();
  };
  const auto with_calibration = [&](const std::string& what, const std::string& by) {
    return error_after(
        [&](const TinyDrive& drive) { replace_in(drive.day() / "calib_cam_to_cam.txt", what, by); });
  };
  CHECK_THAT(error_after([](const auto& drive) { fs::remove(drive.day() / "calib_cam_to_cam.txt"); }),
             Catch::Contains("there is no calib_cam_to_cam.txt in the drive or beside it"));
  const TinyDrive whole_day(3, /*raw=*/false);
  fs::remove(whole_day.day() / "calib_cam_to_cam.txt");
  CHECK_THAT(message_of([&] { (void)open_sequence(whole_day.day(), "auto"); }),
             Catch::Contains("there is no calib_cam_to_cam.txt in the drive or beside it"));
  CHECK_THAT(with_calibration("P_rect_01", "P_wrong_01"),
             Catch::Contains("calib_cam_to_cam.txt: has no line 'P_rect_01"));
  CHECK_THAT(with_calibration("S_rect_00: 3.2", "S_rect_00: 9.2"),
             Catch::Contains("says neither S_00 nor S_rect_00") && Catch::Contains("is 320x120 pixels"));
  CHECK_THAT(error_after([](const auto& drive) { fs::remove(drive.drive() / "image_01/timestamps.txt"); }),
             Catch::Contains("image_01/timestamps.txt: missing"));
  CHECK_THAT(error_after([](const auto& drive) {
               write_text(drive.drive() / "image_00/timestamps.txt", TinyDrive::date(0) + "0.1\n");
             }),
             Catch::Contains("image_00/timestamps.txt:2: '0.1' is no date and time"));
  CHECK_THAT(error_after([](const auto& drive) {
               write_text(drive.drive() / "image_00/timestamps.txt",
                          TinyDrive::date(0) + TinyDrive::date(0) + TinyDrive::date(1));
             }),
             Catch::Contains("image_00/timestamps.txt:2: the time is not later"));
  CHECK_THAT(error_after([](const auto& drive) { fs::remove_all(drive.drive() / "image_01"); }),
             Catch::Contains("image_01"));
  const TinyDrive two(3, /*raw=*/false);
  fs::copy(two.drive(), two.day() / "2011_09_26_drive_0002_sync", fs::copy_options::recursive);
  CHECK_THAT(message_of([&] { (void)open_sequence(two.day(), "auto"); }),
             Catch::Contains("contains 2 drives; name one of them, such as 2011_09_26_drive_0001_sync"));
}

TEST_CASE("A date with the time of day is a stamp", "[kitti]") {
  CHECK(stamp_of_date("2011-09-26 13:02:25.964389445") == 1'317'042'145'964'389'445);
  CHECK(stamp_of_date("2011-09-26 13:02:25") == 1'317'042'145'000'000'000);
  CHECK(stamp_of_date("2011-09-26 13:02:25.5") == 1'317'042'145'500'000'000);
  for (const auto* wrong :
       {"", "2011-09-26", "2011-13-26 13:02:25", "2011-09-26 13:02:25.x", "2011-09-26 13:02:25,5",
        "2011/09/26 13:02:25", "2011-09-26T13:02:25", "x011-09-26 13:02:25"})
    CHECK_FALSE(stamp_of_date(wrong));
}
