// SPDX-License-Identifier: MIT
#include <fstream>
#include <random>
#include <string>

#include <opencv2/imgproc.hpp>

#include "object_pose/artwork.hpp"
#include "object_pose/box_model.hpp"
#include "object_pose/features.hpp"
#include "object_pose/render.hpp"
#include "support/catch.hpp"
#include "support/files.hpp"

namespace {

using namespace object_pose;
using antipode::test::message_of;
using antipode::test::read_text;
using antipode::test::TemporaryFolder;
using antipode::test::write_text;

ModelFile printed_model() {
  std::mt19937_64 rng(1);
  return {SceneSettings{}.camera, print_box({0.2, 0.1, 0.15}, rng)};
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST_CASE("A model is read as it was written", "[object_pose]") {
  const TemporaryFolder folder;
  const ModelFile written = printed_model();
  write_model(folder.path(), written);
  const ModelFile read = load_model(folder.path());
  CHECK(read.camera.fx == written.camera.fx);
  CHECK(read.camera.baseline_m == written.camera.baseline_m);
  CHECK(read.camera.height_px == written.camera.height_px);
  CHECK(read.box.size_m == written.box.size_m);
  REQUIRE(read.box.faces.size() == written.box.faces.size());
  for (std::size_t k = 0; k < read.box.faces.size(); ++k) {
    CHECK(read.box.faces[k].name == written.box.faces[k].name);
    CHECK(cv::norm(read.box.faces[k].texture, written.box.faces[k].texture, cv::NORM_INF) == 0.0);
  }
}

TEST_CASE("Faces have their axes into the box and meet at its corners", "[object_pose]") {
  const ModelFile model = printed_model();
  REQUIRE(model.box.faces.size() == 6);
  for (const auto& face : model.box.faces) {
    const Eigen::Vector3d center = face.T_object_face.translation();
    const Eigen::Vector3d inward = face.T_object_face.rotation_matrix().col(2);
    CHECK(inward.dot(center) == Approx(-center.norm()));
    const Eigen::Vector2d half = 0.5 * face.size_m;
    const Eigen::Vector3d corner = face.T_object_face * Eigen::Vector3d(half.x(), half.y(), 0.0);
    CHECK((corner.cwiseAbs() - 0.5 * model.box.size_m).norm() < 1e-12);
  }
}

TEST_CASE("An invalid model is refused with an error that names the line", "[object_pose]") {
  const TemporaryFolder folder;
  write_model(folder.path(), printed_model());
  const auto file = folder / "model.yaml";
  const std::string good = read_text(file);
  const auto complaint = [&](const std::string& text) {
    write_text(file, text);
    const std::string message = message_of([&] { (void)load_model(folder.path()); });
    CHECK(message.find('\n') == std::string::npos);
    return message;
  };
  CHECK_THAT(complaint(replaced(good, "  fx: 1100", "  fx: wide")), Catch::Contains("camera.fx must be"));
  CHECK_THAT(complaint(replaced(good, "  baseline_m: 0.16", "  # none")),
             Catch::Contains("camera.baseline_m must be"));
  CHECK_THAT(complaint(replaced(good, "front: front.png", "front: nowhere.png")),
             Catch::Contains("no image at"));
  CHECK_THAT(complaint(replaced(good, "front: front.png", "front: model.yaml")),
             Catch::Contains("is not an image"));
  CHECK_THAT(complaint(replaced(good, "front: front.png", "front: right.png")),
             Catch::Contains("other proportions"));
  CHECK_THAT(complaint(replaced(good, "front: front.png", "lid: front.png")),
             Catch::Contains("a box has no face 'lid'"));
  CHECK_THAT(complaint(good.substr(0, good.find("faces:"))), Catch::Contains("no map 'faces'"));
  CHECK_THAT(complaint("camera: {fx: [1"), Catch::Contains("model.yaml:"));
  CHECK_THAT(complaint("just words"), Catch::Contains("not a map"));
  CHECK_THAT(message_of([&] { (void)load_model(folder / "elsewhere"); }), Catch::Contains("no model at"));
}

TEST_CASE("Images without features, or of another size, are refused", "[object_pose]") {
  const ModelFile model = printed_model();
  const FeatureModel features = learn_features(model.box);
  CHECK(features.features.size() == static_cast<std::size_t>(features.descriptors.rows));
  const cv::Mat1b blank(model.camera.height_px, model.camera.width_px, std::uint8_t{128});
  const cv::Mat1b small(480, 640, std::uint8_t{128});
  const auto complaint = [&](const cv::Mat1b& left, const cv::Mat1b& right) {
    return message_of([&] { (void)match_features({left, right}, model.camera, features); });
  };
  CHECK(complaint(blank, blank) == "no features in the left image");
  CHECK_THAT(complaint(blank, small), Catch::Contains("the right image has 640 x 480 px"));
  CHECK_THAT(complaint(small, small), Catch::Contains("the left image has 640 x 480 px"));

  BoxModel plain{model.box.size_m,
                 {make_face(model.box.size_m, "front", cv::Mat1b(150, 200, std::uint8_t{9}))}};
  CHECK(message_of([&] { (void)learn_features(plain); }) == "the faces of the model have no features");
}

}  // namespace
