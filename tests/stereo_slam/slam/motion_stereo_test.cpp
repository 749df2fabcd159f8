// SPDX-License-Identifier: MIT
// A drive whose right camera fails. The SLAM itself is tested: the parts are tested with their folders.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/support/block_drive.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kDriven = 150;  // around the first two corners
constexpr std::size_t kFails = 30;    // the first frame without a right image

/// What a drive led to.
struct FailureOutcome {
  std::string statuses;  ///< one letter a frame: I O W L R
  std::vector<bool> right_image_fits;
  std::vector<double> errors_m, sigmas_m;
  double path_m = 0.0;
};

/// What happens to the frames from `first` up to `mended`.
struct Failure {
  std::function<void(StereoFrame&)> fault;
  std::size_t first = kFails, mended = kDriven;
};

FailureOutcome drive_with(const Failure& failure, std::size_t frames = kDriven) {
  const auto& recording = test::block_drive();
  Settings settings;
  settings.loop_closure.enabled = false;
  Slam slam(recording.camera, settings);
  FailureOutcome outcome;
  for (std::size_t i = 0; i < frames; ++i) {
    StereoFrame frame = recording.frames[i];
    frame.right = frame.right.clone();
    if (i >= failure.first && i < failure.mended) failure.fault(frame);
    const FrameResult result = slam.process(frame);
    outcome.statuses += to_string(result.status)[0];
    outcome.right_image_fits.push_back(result.right_image_fits);
  }
  slam.finish();
  const auto trajectory = slam.trajectory();
  for (std::size_t i = 0; i < frames; ++i) {
    const Eigen::Isometry3d truth = recording.truth.front().inverse() * recording.truth[i];
    outcome.errors_m.push_back((trajectory[i].pose.translation() - truth.translation()).norm());
    outcome.sigmas_m.push_back(std::sqrt(trajectory[i].covariance.bottomRightCorner<3, 3>().trace()));
    if (i > 0)
      outcome.path_m += (recording.truth[i].translation() - recording.truth[i - 1].translation()).norm();
  }
  return outcome;
}

TEST_CASE("While the right image does not fit, the left one alone is tracked", "[stereo_slam][slam]") {
  constexpr std::size_t kFrom = 30;
  constexpr std::size_t kLength = 8;
  const auto& recorded = test::block_drive().frames;
  const std::vector<std::function<void(StereoFrame&)>> faults = {
      [&](StereoFrame& frame) { frame.right = recorded[frame.index - 1].right.clone(); },  // late
      [](StereoFrame& frame) { frame.right.setTo(0); },                                    // covered
      [&](StereoFrame& frame) { frame.right = recorded[kFrom].right.clone(); },            // frozen
  };
  for (std::size_t fault = 0; fault < faults.size(); ++fault) {
    const auto outcome = drive_with({faults[fault], kFrom + 1, kFrom + kLength + 1}, 60);
    CAPTURE(fault, outcome.statuses, outcome.errors_m);
    CHECK(outcome.statuses == "I" + std::string(kFrom, 'O') + std::string(2 * kLength, 'W') +
                                  std::string(59 - kFrom - 2 * kLength, 'O'));
    for (std::size_t i = kFrom + 1; i < 60; ++i) {
      CHECK(outcome.right_image_fits[i] == (i > kFrom + kLength));
      CHECK(outcome.errors_m[i] < 4.0 * outcome.sigmas_m[i]);
    }
    CHECK(outcome.errors_m.back() < 0.1);
  }
}

TEST_CASE("A right camera that fails costs accuracy, but not the track", "[stereo_slam][slam]") {
  const std::vector<std::function<void(StereoFrame&)>> faults = {
      [](StereoFrame& frame) { frame.right.setTo(0); },  // covered
      [](StereoFrame& frame) {                           // no images
        frame.right.setTo(0);
        frame.right_fault = "no file";
      },
      [](StereoFrame& frame) {  // frozen
        if (frame.index > kFails) frame.right = test::block_drive().frames[kFails].right.clone();
      },
  };
  for (std::size_t fault = 0; fault < faults.size(); ++fault) {
    const auto outcome = drive_with({faults[fault]});
    CAPTURE(fault, outcome.statuses, outcome.errors_m, outcome.sigmas_m);
    const std::size_t first_weak = outcome.statuses.find('W');
    CHECK((first_weak == kFails || first_weak == kFails + 1));
    CHECK(std::count(outcome.statuses.begin(), outcome.statuses.end(), 'W') ==
          static_cast<std::ptrdiff_t>(kDriven - first_weak));
    CHECK(outcome.errors_m.back() < 0.01 * outcome.path_m);
    for (std::size_t i = 1; i < kDriven; ++i) CHECK(outcome.errors_m[i] < 3.0 * outcome.sigmas_m[i]);
    // Nobody can know the scale as well as before.
    CHECK(outcome.sigmas_m.back() > 5.0 * outcome.sigmas_m[kFails]);
  }
}

TEST_CASE("A right camera that works again ends the drift of the scale", "[stereo_slam][slam]") {
  constexpr std::size_t kMended = 70;
  const auto outcome = drive_with({[](StereoFrame& frame) { frame.right.setTo(0); }, kFails, kMended});
  CAPTURE(outcome.statuses, outcome.errors_m, outcome.sigmas_m);
  // Doubtful for as many frames as after any fault: twenty.
  CHECK(outcome.statuses == "I" + std::string(kFails - 1, 'O') + std::string(kMended - kFails + 20, 'W') +
                                std::string(kDriven - kMended - 20, 'O'));
  CHECK(outcome.errors_m.back() < 0.004 * outcome.path_m);
  for (std::size_t i = 1; i < kDriven; ++i) CHECK(outcome.errors_m[i] < 3.0 * outcome.sigmas_m[i]);
}

}  // namespace
}  // namespace stereo_slam
