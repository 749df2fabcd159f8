// SPDX-License-Identifier: MIT
// The experiment of MPG sec. VI on rendered boxes.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "object_pose/belief.hpp"
#include "object_pose/estimate.hpp"
#include "object_pose/render.hpp"
#include "support/catch.hpp"

namespace {

using namespace object_pose;

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

/// The belief made of three features that is the last of its kind; nothing if no three agree.
std::optional<Belief> after_three_features(const std::vector<Stage>& stages) {
  std::optional<Belief> belief;
  std::size_t fused = 0;
  for (const auto& stage : stages) {
    if (stage.verdict == Verdict::kFirst) fused = 0;
    if (stage.verdict == Verdict::kFirst || stage.verdict == Verdict::kFused) ++fused;
    if (stage.verdict == Verdict::kFused && fused == 3) belief = stage.after;
  }
  return belief;
}

TEST_CASE("Three features determine the pose of a box and its covariance", "[object_pose]") {
  constexpr std::uint64_t kPoses = 20;
  const EstimateSettings settings;
  std::vector<double> errors_deg, errors_cm;
  int inside = 0;
  for (std::uint64_t seed = 1; seed <= kPoses; ++seed) {
    CAPTURE(seed);
    const Scene scene = render_scene({}, seed);
    const FeatureModel model = learn_features(scene.box);
    const auto matches = match_features(scene.images, scene.camera, model);
    const auto stages = estimate_pose(matches, model, scene.box.size_m, scene.camera, settings);
    for (const auto& stage : stages) CHECK(stage.after.size() <= settings.max_components);
    const auto belief = after_three_features(stages);
    const auto error =
        belief ? error_of(summarize(*belief).pose, scene.T_camera_object) : PoseError{180.0, 100.0};
    errors_deg.push_back(error.rotation_deg);
    errors_cm.push_back(error.translation_cm);
    inside += belief && mass_above(*belief, scene.T_camera_object) <= 0.95 ? 1 : 0;
  }
  CHECK(median(errors_deg) <= 3.0);
  CHECK(median(errors_cm) <= 1.0);
  CHECK(inside >= 18);
}

TEST_CASE("Features of other objects are refused, even as the first", "[object_pose]") {
  const Scene scene = render_scene({}, 11);
  const FeatureModel model = learn_features(scene.box);
  auto matches = match_features(scene.images, scene.camera, model);
  // Of all matches a third, with the first of them, name the next one's feature.
  std::vector<std::size_t> wrong;
  for (std::size_t k = 0; k + 1 < matches.size(); k += 3) {
    matches[k].model_feature = matches[k + 1].model_feature;
    wrong.push_back(k);
  }
  const auto stages = estimate_pose(matches, model, scene.box.size_m, scene.camera);
  REQUIRE(supporting_features(stages) >= 3);
  const auto last_start = std::find_if(stages.rbegin(), stages.rend(),
                                       [](const Stage& stage) { return stage.verdict == Verdict::kFirst; });
  for (auto stage = last_start.base() - 1; stage != stages.end(); ++stage) {
    const bool is_wrong = std::find(wrong.begin(), wrong.end(), stage->match) != wrong.end();
    CHECK((!is_wrong || stage->verdict == Verdict::kRefused));
  }
  CHECK(std::any_of(stages.begin(), stages.end(),
                    [](const Stage& stage) { return stage.verdict == Verdict::kRestart; }));
  const PoseError error = error_of(summarize(stages.back().after).pose, scene.T_camera_object);
  CHECK(error.rotation_deg < 3.0);
  CHECK(error.translation_cm < 1.0);
}

}  // namespace
