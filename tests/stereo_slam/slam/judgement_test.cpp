// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/judgement.hpp"

#include <string>
#include <vector>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

struct Case {
  std::string what;
  FrameEvidence evidence;
  TrackingStatus status;
};

constexpr auto kNothing = PoseBasis::kNothing;
constexpr auto kOdometry = PoseBasis::kOdometry;
constexpr auto kLandmarks = PoseBasis::kLandmarks;
constexpr auto kKeyframe = PoseBasis::kKeyframe;

TEST_CASE("The status of a frame follows from what was measured", "[stereo_slam][slam]") {
  using Status = TrackingStatus;
  const std::vector<Case> cases = {
      {"nothing measured", {.basis = kNothing}, Status::kLost},
      {"nothing measured, a reason besides",
       {.basis = kNothing, .weak = {.right_image_unfit = true, .segment_not_localised = true}},
       Status::kLost},
      {"the same image again", {.waits = true, .weak = {.repeated_image = true}}, Status::kWeak},
      {"the same image for long", {.basis = kNothing, .weak = {.repeated_image = true}}, Status::kLost},
      {"the first map", {.begins_map = true}, Status::kInitializing},
      {"the first map of a run that is not localised in a loaded one",
       {.begins_map = true, .weak = {.segment_not_localised = true}},
       Status::kWeak},
      {"the first map, localised at once",
       {.begins_map = true, .segment_localised = true},
       Status::kRelocalised},
      {"landmarks", {.basis = kLandmarks}, Status::kOk},
      {"few landmarks", {.basis = kLandmarks, .weak = {.few_landmarks = true}}, Status::kWeak},
      {"a sudden motion of few points",
       {.basis = kLandmarks, .weak = {.sudden_motion = true}},
       Status::kWeak},
      {"a repetitive scene", {.basis = kLandmarks, .weak = {.repetitive_scene = true}}, Status::kWeak},
      {"an unfit right image", {.basis = kLandmarks, .weak = {.right_image_unfit = true}}, Status::kWeak},
      {"a turn", {.basis = kLandmarks, .weak = {.right_camera_turned = true}}, Status::kWeak},
      {"a turn that was measured since it happened",
       {.basis = kLandmarks, .turn_measured = true, .weak = {.right_camera_turned = true}},
       Status::kOk},
      {"a segment somewhere", {.basis = kLandmarks, .weak = {.segment_not_localised = true}}, Status::kWeak},
      {"a segment after a short gap",
       {.basis = kLandmarks, .segment_predicted = true, .weak = {.segment_not_localised = true}},
       Status::kOk},
      {"few landmarks in a segment after a short gap",
       {.basis = kLandmarks,
        .segment_predicted = true,
        .weak = {.few_landmarks = true, .segment_not_localised = true}},
       Status::kWeak},
      {"the odometry, which is all that is asked for", {.basis = kOdometry}, Status::kOk},
      {"the odometry alone", {.basis = kOdometry, .weak = {.odometry_alone = true}}, Status::kWeak},
      {"landmarks after a loss", {.basis = kLandmarks, .after_loss = true}, Status::kRelocalised},
      {"few landmarks after a loss",
       {.basis = kLandmarks, .after_loss = true, .weak = {.few_landmarks = true}},
       Status::kRelocalised},
      {"the odometry after a loss",
       {.basis = kOdometry, .after_loss = true, .weak = {.odometry_alone = true}},
       Status::kWeak},
      {"a recognised keyframe", {.basis = kKeyframe}, Status::kRelocalised},
      {"a recognised keyframe, of a segment somewhere",
       {.basis = kKeyframe, .weak = {.segment_not_localised = true}},
       Status::kWeak},
      {"a recognised keyframe with an unfit right image",
       {.basis = kKeyframe, .weak = {.right_image_unfit = true}},
       Status::kWeak},
      {"a segment that was localised just now",
       {.basis = kOdometry, .segment_localised = true, .weak = {.odometry_alone = true}},
       Status::kRelocalised},
  };
  for (const auto& [what, evidence, status] : cases) {
    CAPTURE(what);
    CHECK(to_string(judge(evidence)) == std::string(to_string(status)));
  }
}

TEST_CASE("A pose is found again by a recognised keyframe, or by landmarks after a loss",
          "[stereo_slam][slam]") {
  for (const bool after_loss : {false, true}) {
    CHECK(found_again(kKeyframe, after_loss));
    CHECK(found_again(kLandmarks, after_loss) == after_loss);
    CHECK_FALSE(found_again(kOdometry, after_loss));
    CHECK_FALSE(found_again(kNothing, after_loss));
  }
}

}  // namespace
}  // namespace stereo_slam
