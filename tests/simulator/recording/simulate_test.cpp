// SPDX-License-Identifier: MIT
#include "simulator/recording/simulate.hpp"

#include <cmath>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "simulator/rendering/lens_view.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::simulator;
using namespace stereo_slam::test;

namespace {

/// Small and quick.
SimulationSettings small_settings() {
  SimulationSettings settings;
  settings.frames = 4;
  settings.dynamic_objects = 2;
  settings.camera = {160, 64, 90.0, 90.0, 79.1, 31.6};
  settings.samples_per_pixel = 4;
  settings.texture_size_px = 64;
  return settings;
}

std::vector<std::string> image_names(int frames) {
  std::vector<std::string> names;
  for (int i = 0; i < frames; ++i) {
    names.push_back("image_0/" + frame_name(i));
    names.push_back("image_1/" + frame_name(i));
  }
  return names;
}

/// A pose file with `text` as its second line, and what reading it says.
std::string complaint_about(const std::string& text) {
  const TemporaryFolder folder;
  const auto file = folder / "poses.txt";
  write_text(file, "1 0 0 0 0 1 0 0 0 0 1 0\n" + text + "\n");
  return message_of([&] { static_cast<void>(read_camera_path(file)); });
}

}  // namespace

TEST_CASE("The masks show where moving vehicles have changed the left images", "[simulate]") {
  const TemporaryFolder folder;
  SimulationSettings settings = small_settings();
  settings.moving_masks = true;
  simulator::simulate(settings, folder / "with");
  settings.dynamic_objects = 0;
  simulator::simulate(settings, folder / "without");
  for (int i = 0; i < settings.frames; ++i) {
    const auto load = [&](const std::string& name) {
      return cv::imread((folder / name / frame_name(i)).string(), cv::IMREAD_UNCHANGED);
    };
    const cv::Mat mask = load("with/moving");
    CHECK(cv::countNonZero(mask) > 20);
    CHECK(cv::countNonZero(mask) < static_cast<int>(mask.total()) / 2);
    CHECK(cv::countNonZero(load("without/moving")) == 0);
    const cv::Mat difference = load("with/image_0") != load("without/image_0");
    cv::Mat blurred_mask;  // the sensor spreads the light; its noise is the same
    cv::dilate(mask, blurred_mask, cv::getStructuringElement(cv::MORPH_RECT, {7, 7}));
    CHECK(cv::countNonZero(difference & ~blurred_mask) == 0);
    CHECK(cv::countNonZero(difference) > cv::countNonZero(mask) / 2);
  }
}

TEST_CASE("A simulation is a complete KITTI sequence", "[simulate]") {
  const TemporaryFolder folder;
  const SimulationSettings settings = small_settings();
  std::vector<int> steps;
  simulator::simulate(settings, folder / "seq", [&](int done, int total) {
    CHECK(total == 4);
    steps.push_back(done);
    return true;
  });
  CHECK(steps == std::vector{1, 2, 3, 4});

  for (const std::string& name : image_names(4)) {
    const cv::Mat image = cv::imread((folder / "seq" / name).string(), cv::IMREAD_UNCHANGED);
    REQUIRE(image.type() == CV_8UC1);
    CHECK(image.size() == cv::Size(160, 64));
  }
  CHECK_FALSE(fs::exists(folder / "seq" / image_names(5).back()));

  const auto calibration = split_lines(read_text(folder / "seq/calib.txt"));
  REQUIRE(calibration.size() == 4);
  CHECK(calibration[0].substr(0, 10) == "P0: 90 0 7");
  std::istringstream right(calibration[1].substr(4));
  std::vector<double> numbers;
  for (double number = 0.0; right >> number;) numbers.push_back(number);
  REQUIRE(numbers.size() == 12);
  CHECK(numbers[0] == 90.0);
  CHECK(numbers[2] == 79.1);
  CHECK(numbers[3] == -90.0 * settings.baseline_m);
  CHECK(numbers[6] == 31.6);

  const auto times = split_lines(read_text(folder / "seq/times.txt"));
  REQUIRE(times.size() == 4);
  CHECK(std::stod(times[3]) == Approx(0.3));

  const auto poses = read_trajectory(folder / "seq/poses.txt").poses;
  const auto path = camera_path(settings);
  REQUIRE(poses.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) CHECK(poses[i].isApprox(path[i], 1e-15));
}

TEST_CASE("A simulation that is stopped leaves a shorter, complete recording", "[simulate]") {
  const TemporaryFolder folder;
  SimulationSettings settings = small_settings();
  settings.frames = 40;
  simulator::simulate(settings, folder / "seq", [](int done, int) { return done < 2; });
  const auto poses = read_trajectory(folder / "seq/poses.txt").poses.size();
  CHECK(poses >= 2);
  CHECK(poses < 40);
  CHECK(split_lines(read_text(folder / "seq/times.txt")).size() == poses);
  const auto frames = static_cast<int>(poses);
  for (const std::string& name : image_names(frames)) CHECK(fs::exists(folder / "seq" / name));
  CHECK_FALSE(fs::exists(folder / "seq" / image_names(frames + 1).back()));
}

TEST_CASE("A recording with an IMU has its readings, in either layout", "[simulate][imu]") {
  const TemporaryFolder folder;
  SimulationSettings settings = small_settings();
  settings.imu = ImuSettings{};
  simulator::simulate(settings, folder / "kitti");
  // Four frames at 10 Hz are .3 s, at 200 Hz; and a heading.
  CHECK(split_lines(read_text(folder / "kitti/imu.csv")).size() == 62);
  CHECK_THAT(read_text(folder / "kitti/imu.yaml"), Catch::Contains("gyroscope_noise_density: 0.00017"));
  CHECK(split_lines(read_text(folder / "kitti/imu_truth.csv")).size() == 5);

  settings.rig = euroc_like_rig(Distortion::kRadTan, 0.2);
  simulator::simulate(settings, folder / "euroc");
  const auto rows = split_lines(read_text(folder / "euroc/mav0/imu0/data.csv"));
  CHECK(rows.size() == 62);
  CHECK_THAT(rows.at(1), Catch::StartsWith("1000000000000000000,"));
  CHECK_THAT(rows.back(), Catch::StartsWith("1000000000300000000,"));
  CHECK(fs::exists(folder / "euroc/mav0/imu0/sensor.yaml"));
  const auto truth = split_lines(read_text(folder / "euroc/mav0/state_groundtruth_estimate0/data.csv"));
  CHECK(truth.size() == 5);
  CHECK_THAT(truth.at(1), !Catch::EndsWith(",0,0,0,0,0,0,0,0,0"));

  settings.imu.reset();
  simulator::simulate(settings, folder / "without");
  CHECK_FALSE(fs::exists(folder / "without/mav0/imu0"));
  const auto zeros = split_lines(read_text(folder / "without/mav0/state_groundtruth_estimate0/data.csv"));
  CHECK_THAT(zeros.at(1), Catch::EndsWith(",0,0,0,0,0,0,0,0,0"));
}

TEST_CASE("A recording with an IMU may be stopped after its first frame", "[simulate][imu]") {
  const TemporaryFolder folder;
  SimulationSettings settings = small_settings();
  settings.imu = ImuSettings{};
  settings.threads = 1;
  simulator::simulate(settings, folder / "seq", [](int, int) { return false; });
  CHECK(read_trajectory(folder / "seq/poses.txt").poses.size() == 1);
  CHECK(fs::exists(folder / "seq/imu.csv"));
}

TEST_CASE("The images depend on the seed, not on the number of threads", "[simulate]") {
  const TemporaryFolder folder;
  SimulationSettings settings = small_settings();
  settings.threads = 1;
  simulator::simulate(settings, folder / "one");
  settings.threads = 3;
  simulator::simulate(settings, folder / "three");
  settings.seed = 2;
  simulator::simulate(settings, folder / "other");
  for (const std::string& name : image_names(4)) {
    CHECK(read_text(folder / "one" / name) == read_text(folder / "three" / name));
    CHECK(read_text(folder / "one" / name) != read_text(folder / "other" / name));
  }
}

TEST_CASE("Poses during an exposure are spread evenly around that of the frame", "[simulate]") {
  CameraPath path;
  for (int i = 0; i < 3; ++i) {
    path.push_back(Eigen::Translation3d(0.1 * i, 0.0, 0.5 * i) *
                   Eigen::AngleAxisd(0.2 * i, Eigen::Vector3d::UnitY()));
  }
  const auto poses = poses_during_exposure(path, 1, 0.5, 5);
  REQUIRE(poses.size() == 5);
  CHECK(poses[2].isApprox(path[1], 1e-12));
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    const auto step = Eigen::AngleAxisd((poses[i].inverse() * poses[i + 1]).linear());
    CHECK(step.angle() == Approx(0.2 * 0.1));
  }
  // At the ends of the path there is one neighbour: a whole frame later comes its pose.
  CHECK(poses_during_exposure(path, 0, 4.0, 2)[1].isApprox(path[1], 1e-12));
  CHECK(poses_during_exposure({path[1]}, 0, 1.0, 3)[0].isApprox(path[1], 1e-12));
}

TEST_CASE("An exposure blurs along the motion, and images of a camera at rest not at all", "[simulate]") {
  const TemporaryFolder folder;
  SimulationSettings settings = small_settings();
  settings.dynamic_objects = 0;
  settings.sensor.noise_sigma = 0.0;
  const bool moves = GENERATE(true, false);
  std::string poses;
  for (int i = 0; i < settings.frames; ++i) {
    const double angle_rad = moves ? 0.05 * i : 0.0;  // turns to the right
    poses += fmt::format("{0} 0 {1} 0 0 1 0 0 -{1} 0 {0} 0\n", std::cos(angle_rad), std::sin(angle_rad));
  }
  write_text(folder / "poses.txt", poses);
  settings.trajectory = folder / "poses.txt";
  simulator::simulate(settings, folder / "sharp");
  settings.sensor.exposure_s = 0.1;
  simulator::simulate(settings, folder / "blurred");
  const auto gradients = [&](const std::string& name, int dx, int dy) {
    cv::Mat gradient;
    cv::Sobel(cv::imread((folder / name / "image_0/000001.png").string(), cv::IMREAD_UNCHANGED), gradient,
              CV_32F, dx, dy);
    return cv::norm(gradient, cv::NORM_L2);
  };
  const double along = gradients("blurred", 1, 0) / gradients("sharp", 1, 0);
  const double across = gradients("blurred", 0, 1) / gradients("sharp", 0, 1);
  if (moves) {
    CHECK(along < 0.8);
    CHECK(across > along + 0.05);
  } else {
    CHECK(along == Approx(1.0).epsilon(0.01));
    CHECK(across == Approx(1.0).epsilon(0.01));
  }
}

TEST_CASE("A highway is built along its own drive, or along a pose file", "[simulate]") {
  const TemporaryFolder folder;
  SimulationSettings settings = small_settings();
  settings.scenery = Scenery::kHighway;
  const auto own = camera_path(settings);
  REQUIRE(own.size() == 4);
  CHECK((own[1].translation() - own[0].translation()).norm() == Approx(2.8).epsilon(0.01));
  simulator::simulate(settings, folder / "own");
  settings.trajectory = folder / "own/poses.txt";
  simulator::simulate(settings, folder / "again");
  for (const std::string& name : image_names(4))
    CHECK(read_text(folder / "own" / name) == read_text(folder / "again" / name));
  settings.scenery = Scenery::kTown;
  simulator::simulate(settings, folder / "town");
  CHECK(read_text(folder / "own" / image_names(4)[0]) != read_text(folder / "town" / image_names(4)[0]));
}

TEST_CASE("A sequence along a pose file has as many frames and orthonormal rotations", "[simulate]") {
  const TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 6; ++i)
    text += fmt::format("0.9999 0 0.0141 {} 0 1 0 0 -0.0141 0 0.9999 {}\n", 0.01 * i, 0.7 * i);
  write_text(folder / "poses.txt", text);
  SimulationSettings settings = small_settings();
  settings.trajectory = folder / "poses.txt";
  settings.frames = 0;
  CHECK(camera_path(settings).size() == 6);
  settings.frames = 3;
  CHECK(camera_path(settings).size() == 3);
  settings.frames = 7;
  CHECK_THROWS_WITH(camera_path(settings), Catch::Contains("has 6 poses, fewer than the 7 frames"));
  settings.frames = 6;
  const auto path = camera_path(settings);
  REQUIRE(path.size() == 6);
  for (const auto& pose : path) {
    CHECK((pose.linear().transpose() * pose.linear()).isIdentity(1e-15));
    CHECK(pose.linear()(0, 2) == Approx(0.0141).epsilon(1e-3));
  }
}

TEST_CASE("Faulty pose files are rejected with file and line", "[simulate]") {
  for (const std::string text :
       {"1 0 0 0 0 1 0 0 0 0 1", "1 0 0 0 0 1 0 0 0 0 1 0 0", "1 0 0 x 0 1 0 0 0 0 1 0",
        "1 0 0 nan 0 1 0 0 0 0 1 0", "1 0 0 inf 0 1 0 0 0 0 1 0", "2 0 0 0 0 1 0 0 0 0 1 0",
        "-1 0 0 0 0 1 0 0 0 0 1 0", "0 0 0 0 0 0 0 0 0 0 0 0"}) {
    INFO(text);
    CHECK_THAT(complaint_about(text), Catch::Contains("poses.txt:2"));
  }
  const TemporaryFolder folder;
  write_text(folder / "empty.txt", "\n");
  SimulationSettings settings = small_settings();
  settings.trajectory = folder / "empty.txt";
  CHECK_THAT(message_of([&] { simulator::simulate(settings, folder / "seq"); }),
             Catch::Contains("empty.txt"));
  write_text(folder / "far.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1e6 0 1 0 0 0 0 1 0\n");
  settings.frames = 2;
  settings.trajectory = folder / "far.txt";
  CHECK_THAT(message_of([&] { simulator::simulate(settings, folder / "seq"); }),
             Catch::Contains("far.txt: leads 1e+06 m away from its start"));
  write_text(folder / "jump.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 9e3 0 1 0 0 0 0 1 0\n");
  settings.trajectory = folder / "jump.txt";
  CHECK_THAT(message_of([&] { simulator::simulate(settings, folder / "seq"); }),
             Catch::Contains("jump.txt: poses 1 and 2 are 9e+03 m apart; a camera moves at most 100 m"));
  settings.trajectory = folder / "missing.txt";
  CHECK_THROWS_AS(simulator::simulate(settings, folder / "seq"), std::runtime_error);
  CHECK_FALSE(fs::exists(folder / "seq"));
}

TEST_CASE("Settings out of range are rejected by name before anything is written", "[simulate]") {
  const std::vector<std::pair<std::string, std::function<void(SimulationSettings&)>>> faults = {
      {"frames", [](auto& s) { s.frames = -1; }},
      {"dynamic_objects", [](auto& s) { s.dynamic_objects = -1; }},
      {"fps", [](auto& s) { s.fps = 0.0; }},
      {"fps", [](auto& s) { s.fps = std::nan(""); }},
      {"baseline_m", [](auto& s) { s.baseline_m = -0.5; }},
      {"camera_height_m", [](auto& s) { s.camera_height_m = 0.0; }},
      {"threads", [](auto& s) { s.threads = -2; }},
      {"samples", [](auto& s) { s.samples_per_pixel = 3; }},
      {"texture", [](auto& s) { s.texture_size_px = 100; }},
      {"speed",
       [](auto& s) {
         s.scenery = Scenery::kHighway;
         s.highway.speed_m_s = -1.0;
       }},
      {"focal", [](auto& s) { s.camera.fx = 0.0; }},
      {"blur_sigma_px", [](auto& s) { s.sensor.blur_sigma_px = -0.1; }},
      {"exposure_s", [](auto& s) { s.sensor.exposure_s = 0.2; }},  // two frames
      {"noise_sigma", [](auto& s) { s.sensor.noise_sigma = -1.0; }},
      {"read_noise_share", [](auto& s) { s.sensor.read_noise_share = 2.0; }},
      {"vignetting", [](auto& s) { s.sensor.vignetting = 1.0; }},
      {"exposure_change", [](auto& s) { s.sensor.exposure_change = -0.1; }},
      {"exposure_period_s", [](auto& s) { s.sensor.exposure_period_s = 0.0; }},
      {"gain_mismatch", [](auto& s) { s.sensor.gain_mismatch = 0.9; }}};
  const TemporaryFolder folder;
  for (const auto& [name, fault] : faults) {
    SimulationSettings settings = small_settings();
    fault(settings);
    INFO(name);
    CHECK_THAT(message_of([&] { simulator::simulate(settings, folder / "seq"); }), Catch::Contains(name));
    CHECK_THROWS_AS(simulator::simulate(settings, folder / "seq"), std::invalid_argument);
    CHECK_FALSE(fs::exists(folder / "seq"));
  }
}

TEST_CASE("The output folder is checked before the path is read or built", "[simulate]") {
  SimulationSettings settings = small_settings();
  settings.trajectory = "missing.txt";
  CHECK_THAT(message_of([&] { simulator::simulate(settings, "/proc/seq"); }),
             Catch::Contains("/proc/seq: cannot be used for output"));
}

TEST_CASE("A rectification error that no image can show is none", "[simulate]") {
  const TemporaryFolder folder;
  SimulationSettings settings = small_settings();
  simulator::simulate(settings, folder / "exact");
  settings.rectification_error_px = 1e-200;
  simulator::simulate(settings, folder / "tiny");
  for (const auto* file : {"image_1/000000.png", "calib.txt"}) {
    CHECK(read_text(folder / "tiny" / file) == read_text(folder / "exact" / file));
  }
}

TEST_CASE("A recording is never overwritten", "[simulate]") {
  const TemporaryFolder folder;
  simulator::simulate(small_settings(), folder / "seq");
  const auto image = read_text(folder / "seq/image_1/000000.png");
  SimulationSettings settings = small_settings();
  settings.seed = 2;
  CHECK_THAT(message_of([&] { simulator::simulate(settings, folder / "seq"); }),
             Catch::Contains("seq: not empty"));
  CHECK(read_text(folder / "seq/image_1/000000.png") == image);
  fs::create_directories(folder / "mine");
  write_text(folder / "mine/calib.txt", "mine");
  CHECK_THAT(message_of([&] { simulator::simulate(settings, folder / "mine"); }),
             Catch::Contains("mine: not empty"));
  CHECK(read_text(folder / "mine/calib.txt") == "mine");
}

TEST_CASE("A folder that cannot be written is reported by name", "[simulate]") {
  const TemporaryFolder folder;
  write_text(folder / "seq", "a file in the way");
  const auto message = message_of([&] { simulator::simulate(small_settings(), folder / "seq"); });
  CHECK_THAT(message, Catch::Contains("seq"));
}
