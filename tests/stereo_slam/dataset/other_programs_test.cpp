// SPDX-License-Identifier: MIT
// One stereo camera in the files of many programs.
#include <array>
#include <sstream>

#include <opencv2/calib3d.hpp>

#include "simulator/rendering/lens_view.hpp"
#include "stereo_slam/dataset/calibration_file.hpp"
#include "stereo_slam/dataset/rectifier.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

template <class Matrix>
std::string row_by_row(const Matrix& matrix) {
  std::string text;
  for (int i = 0; i < matrix.rows(); ++i) {
    for (int j = 0; j < matrix.cols(); ++j)
      text += fmt::format("{}{:.17g}", i + j == 0 ? "" : ", ", static_cast<double>(matrix(i, j)));
  }
  return text;
}

template <class Matrix>
std::string opencv_matrix(const Matrix& matrix, const char* type = "d") {
  return fmt::format("!!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: {}\n   data: [ {} ]\n", matrix.rows(),
                     matrix.cols(), type, row_by_row(matrix));
}

Eigen::Matrix3d matrix_of(const Lens& lens) {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = lens.fx;
  K(1, 1) = lens.fy;
  K(0, 2) = lens.cx;
  K(1, 2) = lens.cy;
  return K;
}

Eigen::RowVectorXd coefficients_of(const Lens& lens) {
  return Eigen::Map<const Eigen::RowVectorXd>(lens.coefficients.data(),
                                              static_cast<Eigen::Index>(lens.coefficients.size()));
}

/// EuRoC's rig with a pose in the body.
StereoRig known_rig(Distortion model) {
  StereoRig rig = simulator::euroc_like_rig(model);
  rig.T_body_left = Eigen::Translation3d(0.1, -0.2, 0.3) *
                    Eigen::AngleAxisd(0.5, Eigen::Vector3d(1.0, 2.0, -1.0).normalized());
  return rig;
}

/// R and P of both cameras as cv::stereoRectify gives them.
struct Rectified {
  Eigen::Matrix3d R_left, R_right;
  Eigen::Matrix<double, 3, 4> P_left, P_right;
};

Rectified rectify_with_opencv(const StereoRig& rig) {
  const auto to_cv = [](const Eigen::MatrixXd& matrix) {
    cv::Mat result(static_cast<int>(matrix.rows()), static_cast<int>(matrix.cols()), CV_64F);
    for (int i = 0; i < result.rows; ++i) {
      for (int j = 0; j < result.cols; ++j) result.at<double>(i, j) = matrix(i, j);
    }
    return result;
  };
  cv::Matx33d R1, R2;
  cv::Matx34d P1, P2;
  cv::Matx44d Q;
  cv::stereoRectify(to_cv(matrix_of(rig.left)), to_cv(coefficients_of(rig.left)), to_cv(matrix_of(rig.right)),
                    to_cv(coefficients_of(rig.right)), cv::Size(rig.left.width_px, rig.left.height_px),
                    to_cv(rig.T_right_left.linear()), to_cv(rig.T_right_left.translation()), R1, R2, P1, P2,
                    Q, cv::CALIB_ZERO_DISPARITY, 0.0);
  using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  using RowMajor34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  return {Eigen::Map<RowMajor3>(R1.val), Eigen::Map<RowMajor3>(R2.val), Eigen::Map<RowMajor34>(P1.val),
          Eigen::Map<RowMajor34>(P2.val)};
}

void check_lens(const Lens& lens, const Lens& known) {
  CHECK(lens.width_px == known.width_px);
  CHECK(lens.height_px == known.height_px);
  CHECK(lens.distortion == known.distortion);
  CHECK((matrix_of(lens) - matrix_of(known)).cwiseAbs().maxCoeff() < 1e-12 * known.fx);
  for (std::size_t i = 0; i < std::max(lens.coefficients.size(), known.coefficients.size()); ++i) {
    const auto at = [&](const Lens& one) { return i < one.coefficients.size() ? one.coefficients[i] : 0.0; };
    CHECK(at(lens) == Approx(at(known)).margin(1e-15));
  }
}

/// The same lenses and relative pose, to `tolerance`, and the same rectified camera.
void check_same(const OwnCamera& own, const StereoRig& known, bool with_body, double tolerance = 1e-12) {
  REQUIRE(own.rig);
  check_lens(own.rig->left, known.left);
  check_lens(own.rig->right, known.right);
  CHECK((own.rig->T_right_left.matrix() - known.T_right_left.matrix()).cwiseAbs().maxCoeff() < tolerance);
  REQUIRE(own.rig->T_body_left.has_value() == with_body);
  if (with_body)
    CHECK((own.rig->T_body_left->matrix() - known.T_body_left->matrix()).cwiseAbs().maxCoeff() < tolerance);
  const StereoCamera camera = Rectifier(*own.rig).camera();
  const StereoCamera expected = Rectifier(known).camera();
  const double tolerance_px = 1e3 * tolerance * expected.fx;
  CHECK(std::abs(camera.fx - expected.fx) < tolerance_px);
  CHECK(std::abs(camera.cx - expected.cx) < tolerance_px);
  CHECK(std::abs(camera.cy - expected.cy) < tolerance_px);
  CHECK(std::abs(camera.baseline_m - expected.baseline_m) < 10.0 * tolerance);
}

/// Reads a text as it is, and with the line ends and the byte order mark of Windows, and comments.
template <class Check>
void read_variants(const fs::path& file, const std::string& text, const Check& check) {
  std::string crlf;
  for (const char c : text) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  std::string commented = "# a comment\n";
  const bool is_json = text.front() == '{';
  for (const auto& variant :
       {text, crlf, "\xEF\xBB\xBF" + text, is_json ? text + "\n\n" : commented + text}) {
    CAPTURE(variant);
    write_text(file, variant);
    check(read_calibration(file));
  }
}

std::string error_in(const fs::path& file, const std::string& text) {
  write_text(file, text);
  auto message = message_of([&] { (void)read_calibration(file); });
  CHECK(std::count(message.begin(), message.end(), '\n') == 0);
  CHECK_THAT(message, Catch::Contains(file.filename().string() + ":"));
  return message;
}

std::string replaced(std::string text, const std::string& was, const std::string& is) {
  for (std::size_t at = 0; (at = text.find(was, at)) != std::string::npos; at += is.size())
    text.replace(at, was.size(), is);
  return text;
}

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
      const std::string pinhole =
          fmt::format("\"fx\": {:.17g}, \"fy\": {:.17g}, \"cx\": {:.17g}, \"cy\": {:.17g}", lens.fx, lens.fy,
                      lens.cx, lens.cy);
      const std::string names =
          model == Distortion::kRadTan
              ? ", \"k1\": {:.17g}, \"k2\": {:.17g}, \"p1\": {:.17g}, \"p2\": {:.17g}, \"k3\": 0.0, "
                "\"k4\": 0.0, \"k5\": 0.0, \"k6\": 0.0, \"rpmax\": 2.0"
              : ", \"k1\": {:.17g}, \"k2\": {:.17g}, \"k3\": {:.17g}, \"k4\": {:.17g}";
      return fmt::format("{{\"camera_type\": \"{}\", \"intrinsics\": {{{}{}}}}}",
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
