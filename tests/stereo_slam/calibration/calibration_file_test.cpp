// SPDX-License-Identifier: MIT
#include "stereo_slam/calibration/calibration_file.hpp"

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/opencv_cameras.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("One stereo camera is read from the files of OpenCV, Kalibr and ROS", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  for (const char* name : {"stereo.yaml", "stereo.yml", "stereo.xml"}) {
    CAPTURE(name);
    write_opencv(folder / name, cameras);
    check_rig(read_calibration(folder / name), cameras, 0);
  }
  write_text(folder / "camchain-imucam.yaml", camchain(cameras));
  check_rig(read_calibration(folder / "camchain-imucam.yaml"), cameras, 320, 4);
  write_text(folder / "left.yaml", camera_info(cameras, true));
  write_text(folder / "right.yaml", camera_info(cameras, false));
  check_rig(read_calibration(folder / "left.yaml"), cameras, 320);
  check_rig(read_calibration(folder.path()), cameras, 320);
}

TEST_CASE("The times of the images may be added to the calibration of another program", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  write_opencv(folder / "stereo.yaml", cameras);
  write_text(folder / "camchain.yaml", camchain(cameras));
  write_text(folder / "left.yaml", camera_info(cameras, true));
  write_text(folder / "right.yaml", camera_info(cameras, false));
  for (const char* name : {"stereo.yaml", "camchain.yaml", "left.yaml"}) {
    CAPTURE(name);
    const auto text = read_text(folder / name);
    write_text(folder / name, text + "frame_rate_hz: 20\n");
    CHECK(read_calibration(folder / name).frame_rate_hz == 20.0);
    write_text(folder / name, text + "times: t.txt\n");
    CHECK(read_calibration(folder / name).times == "t.txt");
    write_text(folder / name, text + "frame_rate_hz: fast\n");
    CHECK_THAT(calibration_error(folder / name), Catch::Contains("frame_rate_hz"));
  }
}

TEST_CASE("OpenCV's intrinsics and extrinsics may be two files", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  write_opencv(folder / "intrinsics.yml", cameras, /*with_extrinsics=*/false);
  CHECK_THAT(calibration_error(folder / "intrinsics.yml"),
             Catch::Contains("has no T; add R and T of cv::stereoCalibrate"));
  {
    cv::FileStorage storage((folder / "extrinsics.yml").string(), cv::FileStorage::WRITE);
    storage << "R" << cv::Mat(cameras.R) << "T" << cv::Mat(cameras.T);
  }
  check_rig(read_calibration(folder / "intrinsics.yml"), cameras, 0);
}

TEST_CASE("A calibration without image size takes that of the images", "[calibration]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder / "in", 3);
  fs::remove(folder / "in/calibration.yaml");
  write_text(folder / "in/times.txt", "0\n0.1\n0.2\n");
  write_opencv(folder / "stereo.xml", Cameras());
  auto scan = scan_sequence(folder / "in", "auto", folder / "stereo.xml");
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.camera.width_px == 320);
  CHECK(scan.sequence.frames[2].stamp_ns == 200'000'000);
  CHECK(load_frame(scan.sequence, 1).left.cols == 320);
  // In the folder itself it needs no option.
  fs::rename(folder / "stereo.xml", folder / "in/calibration.xml");
  CHECK(scan_sequence(folder / "in", "auto").problems.empty());
  fs::rename(folder / "in/times.txt", folder / "elsewhere.txt");
  scan = scan_sequence(folder / "in", "auto");
  REQUIRE_FALSE(scan.problems.empty());
  CHECK_THAT(scan.problems[0].text, Catch::Contains("or put times.txt beside the folders"));
}

TEST_CASE("Millimetres and squares of the board are suspected, with what to change", "[calibration]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder / "in", 3);
  write_text(folder / "in/times.txt", "0\n0.1\n0.2\n");
  const auto warning = [&](double unit) {
    write_opencv(folder / "stereo.yaml", Cameras(), true, unit);
    const auto scan = scan_sequence(folder / "in", "auto", folder / "stereo.yaml");
    REQUIRE(scan.problems.size() == 1);
    CHECK_FALSE(is_error(scan.problems[0]));
    return scan.problems[0].text;
  };
  CHECK_THAT(warning(1000.0), Catch::Contains("a baseline of 400 m; lengths must be in metres; if these are "
                                              "millimetres, divide the translation by 1000 (to 0.4 m)"));
  CHECK_THAT(warning(10.0), Catch::Contains("a baseline of 4 m") &&
                                Catch::Contains("if these are centimetres, divide the translation by 100 (to "
                                                "0.04 m)") &&
                                !Catch::Contains("millimetres"));
  CHECK_THAT(warning(30.0), Catch::Contains("a baseline of 12 m") && Catch::Contains("by 100 (to 0.12 m)") &&
                                !Catch::Contains("millimetres"));
  CHECK_THAT(warning(150.0),
             Catch::Contains("a baseline of 60 m") && Catch::Contains("by 100 (to 0.6 m)") &&
                 Catch::Contains("if these are millimetres, divide the translation by 1000 (to "
                                 "0.06 m)"));
  CHECK_THAT(warning(1e5), Catch::Contains("few cameras are so far") && !Catch::Contains("divide"));
  CHECK_THAT(warning(0.001), Catch::Contains("a baseline of 0.0004 m") &&
                                 Catch::Contains("a square of the calibration board"));
}

TEST_CASE("A calibration of another size says what to change", "[calibration]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 3);
  write_text(folder / "times.txt", "0\n0.1\n0.2\n");
  const auto error = [&](const std::string& resolution, const std::string& principal) {
    std::string text = camchain(Cameras());
    for (std::size_t at = 0; (at = text.find("[320, 120]", at)) != std::string::npos;)
      text.replace(at, 10, resolution);
    for (const char* was : {"160, 60]", "158, 61]"}) text.replace(text.find(was), 8, principal);
    write_text(folder / "camchain.yaml", text);
    const auto scan = scan_sequence(folder.path(), "auto", folder / "camchain.yaml");
    REQUIRE_FALSE(scan.problems.empty());
    return scan.problems[0].text;
  };
  CHECK_THAT(error("[640, 240]", "320, 120]"), Catch::Contains("resolution is 640x240") &&
                                                   Catch::Contains("multiply fx, fy, cx and cy by 0.5"));
  CHECK_THAT(error("[160, 120]", "80, 60]"), Catch::Contains("use `layout: side-by-side`"));
  CHECK_THAT(error("[320, 200]", "160, 60]"), Catch::Contains("calibrate at the recorded size"));
}

TEST_CASE("Four coefficients without a model are the only one by which the lenses can exist, or refused",
          "[calibration]") {
  const TemporaryFolder folder;
  const fs::path file = folder / "stereo.yml";
  const auto distortion = [&](double focal_px, std::initializer_list<double> k) {
    write_opencv(file, Fisheyes(focal_px, k));
    const auto rig = read_calibration(file).rig.value();
    CHECK(rig.left.distortion == rig.right.distortion);
    return rig.left.distortion;
  };
  // 160 px of half the width at 90 px: 204 degrees of a fisheye, or 121 of a pinhole.
  CHECK(distortion(90.0, {0.0034, 0.0007, -0.0020, 0.0002}) == Distortion::kEquidistant);
  CHECK(distortion(120.0, {-0.02, 0.06, -0.09, 0.04}) == Distortion::kEquidistant);
  CHECK(distortion(200.0, {0.35, 0.12, 0.06, 0.02}) == Distortion::kEquidistant);
  CHECK(distortion(200.0, {-0.283, 0.074, 0.0002, 0.00002}) == Distortion::kRadTan);  // EuRoC's
  CHECK(distortion(200.0, {0.0, 0.0, 0.0, 0.0}) == Distortion::kNone);

  const auto refusal = [&](const Cameras& cameras, const std::string& line = "") {
    write_opencv(file, cameras);
    write_text(file, read_text(file) + line);
    return calibration_error(file);
  };
  const Fisheyes either(150.0, {-0.01, 0.01, -0.003, 0.0005});
  const auto check_advice = [](const std::string& message) {
    CHECK_THAT(message, Catch::Contains("stereo.yml: has four distortion coefficients") &&
                            Catch::Contains("`distortion_model: plumb_bob`") &&
                            Catch::Contains("`distortion_model: equidistant`"));
  };
  check_advice(refusal(either));
  check_advice(refusal(Fisheyes(60.0, {0.0, 0.0, 0.0, 0.0})));     // no pinhole sees 139 degrees
  check_advice(refusal(Fisheyes(200.0, {-0.9, -0.5, 0.3, 0.1})));  // fits no lens
  check_advice(refusal(Fisheyes(200.0, {1e300, 1e300, 1e300, 1e300})));
  Fisheyes different = either;
  different.D2 = (cv::Mat_<double>(4, 1) << -0.02, 0.06, -0.09, 0.04);
  CHECK(refusal(different).empty());  // the right one decides for both
  CHECK(read_calibration(file).rig->left.distortion == Distortion::kEquidistant);
  different.D2 = (cv::Mat_<double>(1, 5) << -0.01, 0.01, 0.0001, 0.0001, 0.0);
  CHECK(refusal(different).empty());
  CHECK(read_calibration(file).rig->left.distortion == Distortion::kRadTan);
  for (const char* line :
       {"distortion_model: equidistant\n", "fisheye_model: 1\n", "camera_model: fisheye\n"}) {
    CAPTURE(line);
    CHECK(refusal(either, line).empty());
    CHECK(read_calibration(file).rig->left.distortion == Distortion::kEquidistant);
  }
  for (const char* line : {"distortion_model: plumb_bob\n", "fisheye_model: 0\n"}) {
    CAPTURE(line);
    CHECK(refusal(either, line).empty());
    CHECK(read_calibration(file).rig->left.distortion == Distortion::kRadTan);
  }
  check_advice(refusal(either, "camera_model: pinhole\n"));  // which says nothing about the distortion
  CHECK_THAT(refusal(either, "distortion_model: scaramuzza\n"),
             Catch::Contains("distortion_model is scaramuzza"));
}

TEST_CASE("OpenCV's rotation may be a rotation vector, and a fifth coefficient of a fisheye zero",
          "[calibration]") {
  const TemporaryFolder folder;
  Cameras cameras;
  const fs::path file = folder / "stereo.yml";
  write_opencv(file, cameras, /*with_extrinsics=*/false);
  write_text(file, read_text(file) + "R: [0.01, -0.02, 0.03]\nT: [-0.4, 0.002, 0.003]\n");
  check_rig(read_calibration(file), cameras, 0);
  write_opencv(file, cameras, /*with_extrinsics=*/false);
  write_text(file, read_text(file) + "R: [0.01, -0.02, 0.03, 1.0]\nT: [-0.4, 0.002, 0.003]\n");
  CHECK_THAT(calibration_error(file), Catch::Contains("R is not a matrix"));
  write_opencv(file, cameras, /*with_extrinsics=*/false);
  write_text(file, read_text(file) + "R: [0, 0, 0]\nT: [-0.4, 0.002, 0.003]\n");
  CHECK(read_calibration(file).rig->T_right_left.linear().isIdentity(1e-15));

  std::string text = camchain(cameras);  // of a T265
  const auto replace_all = [&](const std::string& was, const std::string& is) {
    for (std::size_t at = 0; (at = text.find(was, at)) != std::string::npos; at += is.size())
      text.replace(at, was.size(), is);
  };
  replace_all("radtan", "equidistant");
  replace_all("coeffs: [", "coeffs: [0.001, ");
  CHECK_THAT((write_text(file, text), calibration_error(file)),
             Catch::Contains("equidistant has 5 distortion coefficients"));
  replace_all("coeffs: [0.001, ", "coeffs: [");
  replace_all("]\n  distortion_model", ", 0.0]\n  distortion_model");
  CHECK(read_calibration_rig(file, text).right.coefficients.size() == 4);
}

TEST_CASE("Contradictions within a calibration of OpenCV are refused", "[calibration]") {
  const TemporaryFolder folder;
  Cameras cameras;
  const fs::path file = folder / "stereo.yml";
  const auto error = [&] {
    write_opencv(file, cameras);
    return calibration_error(file);
  };
  CHECK(error().empty());
  cameras.K2(0, 1) = 3.0;
  CHECK_THAT(error(), Catch::Contains("stereo.yml: M2: the camera matrix has a skew of 3"));
  cameras.K2 = Cameras().K2;
  cameras.K1(2, 2) = 2.0;
  CHECK_THAT(error(), Catch::Contains("the camera matrix is not [fx 0 cx; 0 fy cy; 0 0 1]"));
  cameras.K1 = Cameras().K1;
  write_opencv(file, cameras);
  const std::string text = read_text(file);
  write_text(file, text + "K1: [201, 0, 160, 0, 201, 60, 0, 0, 1]\n");
  CHECK_THAT(calibration_error(file), Catch::Contains("has both M1 and K1, which are the same"));
  write_text(file, text + "distCoeffs2: [0, 0, 0, 0]\n");
  CHECK_THAT(calibration_error(file), Catch::Contains("has both D2 and distCoeffs2"));

  write_text(file, text);
  for (const char* name : {"extrinsics.yml", "extrinsics.xml"}) {
    Cameras other;
    write_opencv(folder / name, other);
    check_rig(read_calibration(file), cameras, 0);
    other.T[0] *= 1.1;
    write_opencv(folder / name, other);
    CHECK_THAT(calibration_error(file), Catch::Contains(std::string("has other R and T than ") + name));
    fs::remove(folder / name);
  }
}

TEST_CASE("Poses in a file of Kalibr that contradict each other are refused", "[calibration]") {
  const TemporaryFolder folder;
  const fs::path file = folder / "camchain.yaml";
  const std::string text = camchain(Cameras());
  const auto error_with = [&](const std::string& of_left, const std::string& of_right) {
    std::string changed = text;
    changed.insert(changed.find("cam1:\n") + 6, of_right);
    write_text(file, changed.insert(6, of_left));
    return calibration_error(file);
  };
  const auto pose = [](const char* key, double x_m, double z_m) {
    return fmt::format("  {}: [1, 0, 0, {}, 0, 1, 0, 0, 0, 0, 1, {}, 0, 0, 0, 1]\n", key, x_m, z_m);
  };
  const Eigen::Isometry3d T_right_left = read_calibration_rig(file, text).T_right_left;
  std::string consistent;
  for (int i = 0; i < 16; ++i)
    consistent += fmt::format("{}{:.4f}", i == 0 ? "" : ", ", T_right_left.matrix()(i / 4, i % 4));
  consistent = "  T_cam_imu: [" + consistent + "]\n";
  CHECK(error_with(pose("T_cam_imu", 0.0, 0.0), consistent).empty());
  CHECK_THAT(error_with(pose("T_cam_imu", 0.0, 0.0), pose("T_cam_imu", -0.4, 0.0)),
             Catch::Contains("camchain.yaml:") && Catch::Contains("T_cn_cnm1 contradicts T_cam_imu"));
  CHECK_THAT(
      error_with(pose("T_BS", 0.0, 0.0), pose("T_BS", 0.4, 0.0)),
      Catch::Contains("T_cn_cnm1 contradicts T_BS of the two cameras, which give a baseline of 0.4 m"));
  CHECK(error_with(pose("T_BS", 0.1, 0.2) + pose("T_cam_imu", -0.1, -0.2), "").empty());
  CHECK(error_with(pose("T_imu_cam", 0.1, 0.2) + pose("T_cam_imu", -0.1, -0.2), "").empty());
  CHECK_THAT(error_with(pose("T_imu_cam", 0.1, 0.2) + pose("T_cam_imu", 0.1, 0.2), ""),
             Catch::Contains("T_cam_imu is not the inverse of T_imu_cam"));
  CHECK_THAT(error_with(pose("T_imu_cam", 0.0, 0.0), pose("T_imu_cam", 0.5, 0.0)),
             Catch::Contains("T_cn_cnm1 contradicts T_imu_cam"));
  CHECK_THAT(error_with(pose("T_BS", 0.1, 0.2) + pose("T_cam_imu", 0.1, 0.2), ""),
             Catch::Contains("camchain.yaml:3: T_cam_imu is not the inverse of T_BS"));
}

TEST_CASE("Damaged calibrations of other programs are refused in one line", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  CHECK_THAT(calibration_error(folder / "nowhere.yaml"), Catch::Contains("nowhere.yaml: missing"));
  write_text(folder / "a.xml", "<opencv_storage><M1>");
  CHECK_THAT(calibration_error(folder / "a.xml"), Catch::Contains("a.xml: "));
  write_text(folder / "a.xml", "<?xml version=\"1.0\"?><opencv_storage><M1>7</M1></opencv_storage>");
  CHECK_THAT(calibration_error(folder / "a.xml"),
             Catch::Contains("M1 is not a matrix or a list of 9 finite numbers"));
  write_text(folder / "nul.yaml",
             std::string("%YAML:1.0\n--\0_size: 32\nM1: !!opencv-matrix\n   rows: 3\n", 54));
  CHECK_THAT(calibration_error(folder / "nul.yaml"), Catch::Contains("nul.yaml:2: there is a zero byte"));
  write_text(folder / "two.yaml", camchain(cameras) + "---\n" + camchain(cameras));
  CHECK_THAT(calibration_error(folder / "two.yaml"), Catch::Contains("two.yaml: holds several documents"));
  write_text(folder / "endless.yaml", "%YAML:1.0\n---t: M132\nM1:\n-\n");  // OpenCV's parser does not end
  CHECK_THAT(calibration_error(folder / "endless.yaml"), Catch::Contains("M1 is not a matrix"));
  std::string deep = "<?xml version=\"1.0\"?><opencv_storage>";
  for (int i = 0; i < 100'000; ++i) deep += "<a>";
  write_text(folder / "deep.xml", deep);
  CHECK_THAT(calibration_error(folder / "deep.xml"),
             Catch::Contains("deep.xml: is no XML file of named values"));
  write_opencv(folder / "b.yaml", cameras);
  std::string text = read_text(folder / "b.yaml");
  write_text(folder / "b.yaml", text.replace(text.find("-2."), 3, ".nan, -2."));
  CHECK_THAT(calibration_error(folder / "b.yaml"), Catch::Contains("b.yaml: "));
  Cameras turned;
  turned.R = turned.R * 2.0;
  write_opencv(folder / "c.yaml", turned);
  CHECK_THAT(calibration_error(folder / "c.yaml"), Catch::Contains("R is not a rotation"));
  Cameras prism;
  prism.D1 = (cv::Mat_<double>(1, 12) << 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.1, 0, 0);
  write_opencv(folder / "d.yaml", prism);
  CHECK_THAT(calibration_error(folder / "d.yaml"), Catch::Contains("radtan has 12 distortion coefficients"));

  write_text(folder / "camera.yaml", camera_info(cameras, true));
  CHECK_THAT(calibration_error(folder / "camera.yaml"),
             Catch::Contains("call the two files left.yaml and right.yaml"));
  write_text(folder / "left.yaml", camera_info(cameras, true));
  CHECK_THAT(calibration_error(folder / "left.yaml"), Catch::Contains("right.yaml: missing"));
  fs::create_directories(folder / "empty");
  CHECK_THAT(calibration_error(folder / "empty"), Catch::Contains("empty: is a folder without left.yaml"));
  write_text(folder / "right.yaml", camera_info(cameras, true));
  CHECK_THAT(calibration_error(folder / "left.yaml"),
             Catch::Contains("right.yaml: the projection matrix has no baseline"));
  write_text(folder / "right.yaml", "image_width: 320\nimage_height: 120\n");
  CHECK_THAT(calibration_error(folder / "left.yaml"),
             Catch::Contains("right.yaml:1: the file has no camera_matrix"));
}
