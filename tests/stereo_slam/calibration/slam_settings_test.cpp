// SPDX-License-Identifier: MIT
// One stereo camera in the settings of ORB-SLAM and stella_vslam.
#include <array>
#include <sstream>

#include "stereo_slam/calibration/calibration_file.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/known_rig.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// `prefix.fx: ...` of ORB-SLAM.
std::string orb_lens(const std::string& prefix, const Lens& lens) {
  std::string text = fmt::format("{0}.fx: {1:.17g}\n{0}.fy: {2:.17g}\n{0}.cx: {3:.17g}\n{0}.cy: {4:.17g}\n",
                                 prefix, lens.fx, lens.fy, lens.cx, lens.cy);
  const bool fisheye = lens.distortion == Distortion::kEquidistant;
  for (std::size_t i = 0; i < lens.coefficients.size(); ++i) {
    const char* name =
        fisheye ? std::array{"k1", "k2", "k3", "k4"}.at(i) : std::array{"k1", "k2", "p1", "p2", "k3"}.at(i);
    text += fmt::format("{}.{}: {:.17g}\n", prefix, name, lens.coefficients[i]);
  }
  return text;
}

}  // namespace
TEST_CASE("Settings of ORB-SLAM3 give both cameras and their relative pose", "[calibration]") {
  const TemporaryFolder folder;
  for (const auto model : {Distortion::kRadTan, Distortion::kEquidistant}) {
    const StereoRig rig = known_rig(model);
    const char* type = model == Distortion::kRadTan ? "PinHole" : "KannalaBrandt8";
    const Eigen::Matrix4d T_left_right = rig.T_right_left.inverse().matrix();
    const std::string head = fmt::format("%YAML:1.0\n\nFile.version: \"1.0\"\nCamera.type: \"{}\"\n", type);
    const std::string size = fmt::format("Camera.width: {}\nCamera.height: {}\nCamera.fps: 20\n",
                                         rig.left.width_px, rig.left.height_px);
    const std::string cameras = orb_lens("Camera1", rig.left) + orb_lens("Camera2", rig.right) + size;
    const std::string body = "IMU.T_b_c1: " + opencv_matrix(rig.T_body_left->matrix(), "f");
    const std::string text = head + cameras +
                             "Stereo.ThDepth: 60.0\nStereo.T_c1_c2: " + opencv_matrix(T_left_right, "f") +
                             body + "ORBextractor.nFeatures: 1200\n";
    read_variants(folder / "EuRoC.yaml", text, [&](const OwnCamera& own) { check_same(own, rig, true); });
    CHECK_THAT(error_in(folder / "EuRoC.yaml", replaced(text, type, "Fisheye624")),
               Catch::Contains("Camera.type is Fisheye624, but must be"));
    CHECK_THAT(error_in(folder / "EuRoC.yaml", head + cameras),
               Catch::Contains("of ORB-SLAM for one camera"));
    // The keys of its first version.
    const std::string old = head + replaced(cameras, "Camera1.", "Camera.") + "Tlr: " +
                            opencv_matrix(Eigen::Matrix<double, 3, 4>(T_left_right.topRows<3>()), "f");
    read_variants(folder / "TUM-VI.yaml", old, [&](const OwnCamera& own) { check_same(own, rig, false); });
  }
}

TEST_CASE("Settings of ORB-SLAM2 are of rectified images, or of raw ones with LEFT.K and RIGHT.K",
          "[calibration]") {
  const TemporaryFolder folder;
  const fs::path file = folder / "orb.yaml";
  const StereoRig rig = known_rig(Distortion::kRadTan);
  const Rectified rectified = rectify_with_opencv(rig);
  const auto& P_left = rectified.P_left;
  const auto& P_right = rectified.P_right;
  const auto side = [&](const char* name, const Lens& lens, const Eigen::Matrix3d& R,
                        const Eigen::MatrixXd& P) {
    return fmt::format("{0}.height: {1}\n{0}.width: {2}\n{0}.D: {3}{0}.K: {4}{0}.R: {5}{0}.P: {6}", name,
                       lens.height_px, lens.width_px, opencv_matrix(coefficients_of(lens)),
                       opencv_matrix(matrix_of(lens)), opencv_matrix(R), opencv_matrix(P));
  };
  const std::string camera = fmt::format(
      "%YAML:1.0\nCamera.fx: {:.17g}\nCamera.fy: {:.17g}\nCamera.cx: {:.17g}\nCamera.cy: {:.17g}\nCamera.k1: "
      "0.0\n"
      "Camera.k2: 0.0\nCamera.p1: 0.0\nCamera.p2: 0.0\nCamera.width: 752\nCamera.height: 480\nCamera.bf: "
      "{:.17g}\n",
      P_left(0, 0), P_left(1, 1), P_left(0, 2), P_left(1, 2), -P_right(0, 3));
  // Without a model, EuRoC's four coefficients can only be radtan.
  const std::string raw = camera + side("LEFT", rig.left, rectified.R_left, P_left) +
                          side("RIGHT", rig.right, rectified.R_right, P_right);
  read_variants(file, raw, [&](const OwnCamera& own) { check_same(own, rig, false); });
  CHECK_THAT(error_in(file, replaced(raw, "RIGHT.K", "RIGHT.Q")), Catch::Contains("RIGHT has no K; add it"));
  read_variants(file, camera, [&](const OwnCamera& own) {
    REQUIRE(own.rectified);
    CHECK(own.rectified->fx == Approx(P_left(0, 0)));
    CHECK(own.rectified->cy == Approx(P_left(1, 2)));
    CHECK(own.rectified->width_px == 752);
    CHECK(own.rectified->baseline_m == Approx(rig.T_right_left.translation().norm()).epsilon(1e-12));
  });
  CHECK_THAT(error_in(file, replaced(camera, "k1: 0.0", "k1: -0.3")), Catch::Contains("Camera is distorted"));
  CHECK_THAT(error_in(file, replaced(camera, "bf: ", "bf: -")), Catch::Contains("the baseline is -0.3"));
  CHECK_THAT(error_in(file, camera + "DepthMapFactor: 5000.0\n"), Catch::Contains("for a depth camera"));
  const std::string rectified3 =
      "File.version: \"1.0\"\nCamera.type: \"Rectified\"\nCamera1.fx: 400.0\nCamera1.fy: 400.0\nCamera1.cx: "
      "320.0\n"
      "Camera1.cy: 240.0\nCamera.width: 640\nCamera.height: 480\nStereo.b: 0.0745\n";
  write_text(file, rectified3);
  CHECK(read_calibration(file).rectified->baseline_m == 0.0745);
}

TEST_CASE("Settings of stella_vslam give raw cameras by StereoRectifier, or a rectified one",
          "[calibration]") {
  const TemporaryFolder folder;
  const fs::path file = folder / "stella.yaml";
  const StereoRig rig = known_rig(Distortion::kRadTan);
  const Rectified rectified = rectify_with_opencv(rig);
  const auto& P_left = rectified.P_left;
  const auto& P_right = rectified.P_right;
  const std::string camera = fmt::format(
      "Camera:\n  name: \"EuRoC stereo\"\n  setup: \"stereo\"\n  model: \"perspective\"\n  fx: {:.17g}\n  "
      "fy: {:.17g}\n"
      "  cx: {:.17g}\n  cy: {:.17g}\n  k1: 0.0\n  fps: 20.0\n  cols: 752\n  rows: 480\n  color_order: "
      "\"Gray\"\n"
      "  focal_x_baseline: {:.17g}\n  depth_threshold: 40\n",
      P_left(0, 0), P_left(1, 1), P_left(0, 2), P_left(1, 2), -P_right(0, 3));
  const std::string rectifier = fmt::format(
      "StereoRectifier:\n  model: \"perspective\"\n  K_left: [{}]\n  D_left: [{}]\n  R_left: [{}]\n  "
      "K_right: [{}]\n"
      "  D_right: [{}]\n  R_right: [{}]\n",
      row_by_row(matrix_of(rig.left)), row_by_row(coefficients_of(rig.left)), row_by_row(rectified.R_left),
      row_by_row(matrix_of(rig.right)), row_by_row(coefficients_of(rig.right)),
      row_by_row(rectified.R_right));
  read_variants(file, camera + rectifier, [&](const OwnCamera& own) { check_same(own, rig, false); });
  // OpenVSLAM wrote keys with points.
  std::string flat;
  std::istringstream lines(camera + rectifier);
  std::string section;
  for (std::string line; std::getline(lines, line);) {
    if (line.front() != ' ')
      section = line.substr(0, line.size() - 1);
    else
      flat += section + "." + line.substr(2) + "\n";
  }
  read_variants(file, flat, [&](const OwnCamera& own) { check_same(own, rig, false); });
  read_variants(file, camera, [&](const OwnCamera& own) {
    REQUIRE(own.rectified);
    CHECK(own.rectified->baseline_m == Approx(rig.T_right_left.translation().norm()).epsilon(1e-12));
  });
  CHECK_THAT(error_in(file, replaced(camera, "k1: 0.0", "k1: -0.3")), Catch::Contains("Camera.k1 is not 0"));
  CHECK_THAT(error_in(file, replaced(camera, "focal_x_baseline", "x")),
             Catch::Contains("of stella_vslam for one camera"));
  CHECK_THAT(error_in(file, camera + replaced(rectifier, "perspective", "equirectangular")),
             Catch::Contains("StereoRectifier.model is equirectangular"));
}
