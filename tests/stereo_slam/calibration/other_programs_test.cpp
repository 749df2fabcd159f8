// SPDX-License-Identifier: MIT
// One stereo camera in the files of ZED cameras, VINS-Fusion, OpenVINS and Basalt.
#include "stereo_slam/calibration/calibration_file.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/known_rig.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("SN.conf of a ZED camera gives a rig for each resolution", "[calibration]") {
  const TemporaryFolder folder;
  const fs::path file = folder / "SN1234.conf";
  StereoRig rig = known_rig(Distortion::kRadTan);
  rig.T_body_left.reset();
  const Eigen::AngleAxisd turn(rig.T_right_left.linear());
  const Eigen::Vector3d r = turn.angle() * turn.axis();
  const Eigen::Vector3d t_mm = 1e3 * rig.T_right_left.translation();
  const auto section = [](const char* name, const Lens& lens) {
    const auto& k = lens.coefficients;
    return fmt::format(
        "[{}]\nfx={:.17g}\nfy={:.17g}\ncx={:.17g}\ncy={:.17g}\nk1={:.17g}\nk2={:.17g}\np1={:.17g}\n"
        "p2={:.17g}\nk3=0\n\n",
        name, lens.fx, lens.fy, lens.cx, lens.cy, k[0], k[1], k[2], k[3]);
  };
  const auto sized = [&](double factor, int width, int height) {
    StereoRig scaled = rig;
    for (Lens* lens : {&scaled.left, &scaled.right}) {
      lens->fx *= factor;
      lens->fy *= factor;
      lens->cx *= factor;
      lens->cy *= factor;
      lens->width_px = width;
      lens->height_px = height;
    }
    return scaled;
  };
  const StereoRig hd = sized(1.5, 1280, 720);
  const StereoRig vga = sized(0.75, 672, 376);
  const std::string cameras = section("LEFT_CAM_HD", hd.left) + section("RIGHT_CAM_HD", hd.right) +
                              section("LEFT_CAM_VGA", vga.left) + section("RIGHT_CAM_VGA", vga.right);
  std::string stereo =
      fmt::format("[STEREO]\nBaseline={:.17g}\nTY={:.17g}\nTZ={:.17g}\n", -t_mm.x(), t_mm.y(), t_mm.z());
  for (const char* size : {"HD", "VGA"})
    stereo += fmt::format("RX_{0}={1:.17g}\nCV_{0}={2:.17g}\nRZ_{0}={3:.17g}\n", size, r.x(), r.y(), r.z());
  const std::string text = cameras + stereo + "\n[MISC]\nSensor_ID=0\n";
  read_variants(file, text, [&](const OwnCamera& own) {
    check_same(own, hd, false);
    REQUIRE(own.other_sizes.size() == 1);
    OwnCamera other;
    other.rig = rig_for(own, {672, 376}, {672, 376});
    check_same(other, vga, false);
    CHECK(rig_for(own, {1280, 720}, {1280, 720}).left.width_px == 1280);
  });
  read_variants(
      file, replaced(replaced(text, "=", " =\t"), "TY =\t", "TY_HD = 9\nTY_VGA = 9\nIGNORED = "),
      [](const OwnCamera& own) { CHECK(own.rig->T_right_left.translation().y() == Approx(0.009)); });
  CHECK_THAT(error_in(file, replaced(text, "Baseline=", "Baseline=0.12\nOld=")),
             Catch::Contains("must be positive, in milli"));
  CHECK_THAT(error_in(file, replaced(text, "RX_", "R_")), Catch::Contains("has no resolution with"));
  CHECK_THAT(error_in(file, replaced(text, "fx=", "focal=")), Catch::Contains("has no fx; add it"));
  CHECK_THAT(error_in(file, replaced(text, "[STEREO]", "fx=")), Catch::Contains("fx is given twice"));
  CHECK_THAT(error_in(file, replaced(text, "Sensor_ID=0", "Sensor_ID")),
             Catch::Contains("is not a line `key = value`"));

  const auto rational =
      replaced(text, "[STEREO]",
               "[LEFT_DISTO]\nk1=1\nk2=2\np1=0.3\np2=0.4\nk3=5\nk4=6\nk5=7\nk6=8\n[RIGHT_DISTO]\n"
               "k1=1\nk2=2\np1=0.3\np2=0.4\nk3=5\nk4=6\nk5=7\nk6=8\n[STEREO]");
  write_text(file, rational);
  CHECK(read_calibration(file).rig->right.coefficients == std::vector<double>{1, 2, 0.3, 0.4, 5, 6, 7, 8});
  const std::string four = "k1=0.01\nk2=-0.02\nk3=0.003\nk4=0.0001\n";
  write_text(file,
             replaced(text, "[STEREO]", "[LEFT_DISTO]\n" + four + "[RIGHT_DISTO]\n" + four + "[STEREO]"));
  CHECK(read_calibration(file).rig->left.distortion == Distortion::kEquidistant);

  // The size of the images decides.
  write_text(file, text);
  write_tiny_folders(folder / "in", 3);
  write_text(folder / "in/times.txt", "0\n0.1\n0.2\n");
  const auto scan = scan_sequence(folder / "in", "auto", file);
  REQUIRE_FALSE(scan.problems.empty());
  CHECK_THAT(scan.problems[0].text,
             Catch::Contains("resolution is 1280x720, but ") &&
                 Catch::Contains("it is also of 672x376; record at one of these sizes"));
}

TEST_CASE("Settings of VINS-Fusion name the files of both cameras", "[calibration]") {
  const TemporaryFolder folder;
  const fs::path file = folder / "euroc_stereo_imu_config.yaml";
  for (const auto model : {Distortion::kRadTan, Distortion::kEquidistant}) {
    const StereoRig rig = known_rig(model);
    const Eigen::Matrix4d T_body_right = (*rig.T_body_left * rig.T_right_left.inverse()).matrix();
    const auto camera = [&](const Lens& lens) {
      const auto& k = lens.coefficients;
      const std::string head = fmt::format("image_width: {}\nimage_height: {}\ncamera_name: camera\n",
                                           lens.width_px, lens.height_px);
      if (model == Distortion::kRadTan) {
        return fmt::format(
            "%YAML:1.0\n---\nmodel_type: PINHOLE\n{}distortion_parameters:\n   k1: {:.17g}\n   k2: {:.17g}\n"
            "   p1: {:.17g}\n   p2: {:.17g}\nprojection_parameters:\n   fx: {:.17g}\n   fy: {:.17g}\n"
            "   cx: {:.17g}\n   cy: {:.17g}\n",
            head, k[0], k[1], k[2], k[3], lens.fx, lens.fy, lens.cx, lens.cy);
      }
      return fmt::format(
          "%YAML:1.0\n---\nmodel_type: KANNALA_BRANDT\n{}projection_parameters:\n   k2: {:.17g}\n   k3: "
          "{:.17g}\n   k4: {:.17g}\n   k5: {:.17g}\n   mu: {:.17g}\n   mv: {:.17g}\n   u0: {:.17g}\n"
          "   v0: {:.17g}\n",
          head, k[0], k[1], k[2], k[3], lens.fx, lens.fy, lens.cx, lens.cy);
    };
    write_text(folder / "cam0.yaml", camera(rig.left));
    write_text(folder / "cam1.yaml", camera(rig.right));
    const std::string text =
        "%YAML:1.0\nimu: 1\nnum_of_cam: 2\ncam0_calib: \"cam0.yaml\"\ncam1_calib: \"cam1.yaml\"\n"
        "image_width: 752\nimage_height: 480\nbody_T_cam0: " +
        opencv_matrix(rig.T_body_left->matrix()) + "body_T_cam1: " + opencv_matrix(T_body_right);
    read_variants(file, text, [&](const OwnCamera& own) { check_same(own, rig, true); });
    CHECK_THAT(error_in(file, replaced(text, "cam1_calib: \"cam1.yaml\"\n", "")),
               Catch::Contains("of VINS for one camera"));
    CHECK_THAT(error_in(folder / "cam0.yaml", camera(rig.left)),
               Catch::Contains("is one camera of VINS; name the settings"));
    write_text(file, text);
    write_text(folder / "cam1.yaml", replaced(camera(rig.right), "model_type: ", "model_type: MEI_"));
    CHECK_THAT(message_of([&] { (void)read_calibration(file); }),
               Catch::Contains("cam1.yaml:3: model_type is MEI_") &&
                   Catch::Contains("must be PINHOLE or KANNALA_BRANDT"));
    fs::remove(folder / "cam1.yaml");
    CHECK_THAT(message_of([&] { (void)read_calibration(file); }), Catch::Contains("cam1.yaml: missing; "));
    write_text(file, replaced(text, "cam1.yaml", std::string(300, 'x')));  // no file can have such a name
    CHECK_THAT(message_of([&] { (void)read_calibration(file); }), Catch::Contains("xxx: missing; "));
  }
}

TEST_CASE("Settings of OpenVINS name a file of Kalibr's kind with T_imu_cam", "[calibration]") {
  const TemporaryFolder folder;
  for (const auto model : {Distortion::kRadTan, Distortion::kEquidistant}) {
    const StereoRig rig = known_rig(model);
    const auto camera = [&](const char* name, const Lens& lens, const Eigen::Matrix4d& T) {
      std::string text = fmt::format("{}:\n  T_imu_cam: #rotation from camera to IMU\n", name);
      for (int i = 0; i < 4; ++i)
        text += fmt::format("    - [{}]\n", row_by_row(Eigen::RowVector4d(T.row(i))));
      return text + fmt::format(
                        "  cam_overlaps: [1]\n  camera_model: pinhole\n  distortion_coeffs: [{}]\n"
                        "  distortion_model: {}\n  intrinsics: [{:.17g}, {:.17g}, {:.17g}, {:.17g}]\n"
                        "  resolution: [{}, {}]\n  rostopic: /cam0/image_raw\n",
                        row_by_row(coefficients_of(lens)), to_string(model), lens.fx, lens.fy, lens.cx,
                        lens.cy, lens.width_px, lens.height_px);
    };
    const std::string chain =
        "%YAML:1.0\n\n" + camera("cam0", rig.left, rig.T_body_left->matrix()) +
        camera("cam1", rig.right, (*rig.T_body_left * rig.T_right_left.inverse()).matrix());
    read_variants(folder / "kalibr_imucam_chain.yaml", chain,
                  [&](const OwnCamera& own) { check_same(own, rig, true); });
    write_text(folder / "kalibr_imucam_chain.yaml", chain);
    read_variants(
        folder / "estimator_config.yaml",
        "%YAML:1.0 # need to specify the file type at the top!\n\nverbosity: \"INFO\"\nuse_stereo: true\n"
        "relative_config_imu: \"kalibr_imu_chain.yaml\"\nrelative_config_imucam: "
        "\"kalibr_imucam_chain.yaml\"\n",
        [&](const OwnCamera& own) { check_same(own, rig, true); });
  }
}

TEST_CASE("Calibrations of Basalt are read if their cameras are kb4 or pinholes", "[calibration]") {
  const TemporaryFolder folder;
  const fs::path file = folder / "calib.json";
  for (const auto model : {Distortion::kRadTan, Distortion::kEquidistant}) {
    const StereoRig rig = known_rig(model);
    const auto pose = [](const Eigen::Isometry3d& T) {
      const Eigen::Quaterniond q(T.linear());
      return fmt::format(
          "{{\n\t\t\t\t\"px\": {:.17g},\n\t\t\t\t\"py\": {:.17g}, \"pz\": {:.17g}, \"qx\": {:.17g}, \"qy\": "
          "{:.17g}, \"qz\": {:.17g}, \"qw\": {:.17g}\n\t\t\t}}",
          T.translation().x(), T.translation().y(), T.translation().z(), q.x(), q.y(), q.z(), q.w());
    };
    const auto lens_text = [&](const Lens& lens) {
      const auto& k = lens.coefficients;
      const std::string pinhole = fmt::format(R"("fx": {:.17g}, "fy": {:.17g}, "cx": {:.17g}, "cy": {:.17g})",
                                              lens.fx, lens.fy, lens.cx, lens.cy);
      const std::string names =
          model == Distortion::kRadTan
              ? R"(, "k1": {:.17g}, "k2": {:.17g}, "p1": {:.17g}, "p2": {:.17g}, "k3": 0.0, )"
                R"("k4": 0.0, "k5": 0.0, "k6": 0.0, "rpmax": 2.0)"
              : R"(, "k1": {:.17g}, "k2": {:.17g}, "k3": {:.17g}, "k4": {:.17g})";
      return fmt::format(R"({{"camera_type": "{}", "intrinsics": {{{}{}}}}})",
                         model == Distortion::kRadTan ? "pinhole-radtan8" : "kb4", pinhole,
                         fmt::format(fmt::runtime(names), k[0], k[1], k[2], k[3]));
    };
    const std::string text = fmt::format(
        "{{\n\t\"value0\": {{\n\t\t\"T_imu_cam\": [\n\t\t\t{},\n\t\t\t{}\n\t\t],\n\t\t\"intrinsics\": [{}, "
        "{}],\n"
        "\t\t\"resolution\": [[{}, {}], [{}, {}]],\n\t\t\"vignette\": []\n\t}}\n}}\n",
        pose(*rig.T_body_left), pose(*rig.T_body_left * rig.T_right_left.inverse()), lens_text(rig.left),
        lens_text(rig.right), rig.left.width_px, rig.left.height_px, rig.right.width_px, rig.right.height_px);
    read_variants(file, text, [&](const OwnCamera& own) { check_same(own, rig, true); });
    CHECK_THAT(error_in(file, replaced(replaced(text, "kb4", "ds"), "pinhole-radtan8", "ds")),
               Catch::Contains("camera_type is ds, but must be kb4"));
    CHECK_THAT(error_in(file, replaced(text, "\"qw\": ", "\"qw\": 7")), Catch::Contains("not of a rotation"));
    CHECK_THAT(error_in(file, replaced(text, "resolution", "size")),
               Catch::Contains("value0 has no resolution"));
  }
}

TEST_CASE("A calibration of one camera is named as such", "[calibration]") {
  const TemporaryFolder folder;
  CHECK_THAT(
      error_in(
          folder / "out_camera_data.yml",
          "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
          "distortion_coefficients: [0, 0, 0, 0, 0]\n"),
      Catch::Contains("is the calibration of one camera; calibrate the two cameras as a stereo pair"));
  CHECK_THAT(error_in(folder / "sensor.yaml", "resolution: [752, 480]\nintrinsics: [458, 457, 367, 248]\n"),
             Catch::Contains("is the calibration of one camera"));
}
