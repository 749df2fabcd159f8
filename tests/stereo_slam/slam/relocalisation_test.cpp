// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "stereo_slam/results/map_file.hpp"
#include "stereo_slam/settings/presets.hpp"
#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/support/block_drive.hpp"
#include "stereo_slam/support/random_map.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kFrames = test::BlockDrive::kFramesOfOneLap;
constexpr std::size_t kFramesOfTwoLaps = test::BlockDrive::kFrames;  // nearly

const test::BlockDrive& recording() { return test::block_drive(); }

/// What happens to the images of a drive: which of the recording's frames is seen at each step, and how.
struct Drive {
  std::vector<std::size_t> seen;
  std::function<void(std::size_t step, StereoFrame&)> disturb = [](std::size_t, StereoFrame&) {};
};

std::vector<std::size_t> range(std::size_t first, std::size_t end) {
  std::vector<std::size_t> result;
  for (std::size_t i = first; i < end; ++i) result.push_back(i);
  return result;
}

struct Outcome {
  std::vector<TrackingStatus> statuses;
  std::vector<FrameResult> results;
  std::vector<PoseGaussian> trajectory;
  std::vector<double> errors_m;  ///< of the final positions

  [[nodiscard]] double rms_error_m(const std::function<bool(std::size_t)>& counts) const {
    double sum = 0.0;
    double n = 0.0;
    for (std::size_t i = 0; i < errors_m.size(); ++i) {
      if (!counts(i)) continue;
      sum += errors_m[i] * errors_m[i];
      n += 1.0;
    }
    return std::sqrt(sum / n);
  }

  /// One letter a frame: I O W L R.
  [[nodiscard]] std::string letters() const {
    std::string result;
    for (const auto status : statuses) result += to_string(status)[0];
    return result;
  }

  [[nodiscard]] std::size_t count(TrackingStatus status) const {
    return static_cast<std::size_t>(std::count(statuses.begin(), statuses.end(), status));
  }

  [[nodiscard]] std::size_t first(TrackingStatus status) const {
    return static_cast<std::size_t>(std::find(statuses.begin(), statuses.end(), status) - statuses.begin());
  }
};

/// The errors are those of positions relative to the recording's frame `origin`.
Outcome run(const Drive& drive, SlamSystem& slam, std::size_t origin) {
  Outcome outcome;
  for (std::size_t step = 0; step < drive.seen.size(); ++step) {
    StereoFrame frame = recording().frames[drive.seen[step]];
    frame.left = frame.left.clone();
    frame.right = frame.right.clone();
    frame.index = step;
    frame.stamp_ns = 142'857'143LL * static_cast<std::int64_t>(step);
    drive.disturb(step, frame);
    outcome.results.push_back(slam.process(frame));
    outcome.statuses.push_back(outcome.results.back().status);
  }
  slam.finish();
  outcome.trajectory = slam.trajectory();
  const auto& truth = recording().truth;
  for (std::size_t step = 0; step < drive.seen.size(); ++step) {
    const Eigen::Isometry3d T = truth[origin].inverse() * truth[drive.seen[step]];
    outcome.errors_m.push_back((outcome.trajectory[step].pose.translation() - T.translation()).norm());
  }
  return outcome;
}

Outcome run(const Drive& drive) {
  Slam slam(recording().camera, Settings{});
  return run(drive, slam, drive.seen.front());
}

void blacken(StereoFrame& frame) {
  frame.left.setTo(0);
  frame.right.setTo(0);
}

/// Fresh noise, as the sensor would add it to the same view again.
void add_noise(StereoFrame& frame) {
  cv::RNG random(frame.index + 1);
  for (cv::Mat* image : {&frame.left, &frame.right}) {
    cv::Mat noise(image->size(), CV_16SC1);
    random.fill(noise, cv::RNG::NORMAL, 0.0, 3.0);
    cv::Mat sum;
    image->convertTo(sum, CV_16SC1);
    sum += noise;
    sum.convertTo(*image, CV_8UC1);
  }
}

const Outcome& undisturbed() {
  static const Outcome outcome = run({range(0, kFrames)});
  return outcome;
}

bool every(std::size_t) { return true; }

TEST_CASE("Over thirty black frames the covariance grows, and a loop joins the map again",
          "[stereo_slam][relocalisation]") {
  const auto black = [](std::size_t step) { return step >= 100 && step < 130; };
  const auto outcome = run({range(0, kFrames), [&](std::size_t step, StereoFrame& frame) {
                              if (black(step)) blacken(frame);
                            }});
  CAPTURE(outcome.letters(), outcome.errors_m[115], outcome.errors_m[150], outcome.errors_m.back());
  for (std::size_t i = 100; i < 130; ++i) {
    CAPTURE(i);
    CHECK(outcome.statuses[i] == TrackingStatus::kLost);
    CHECK(outcome.results[i].T_world_camera.covariance.trace() >
          outcome.results[i - 1].T_world_camera.covariance.trace());
    CHECK(outcome.errors_m[i] <
          3.0 * std::sqrt(outcome.trajectory[i].covariance.bottomRightCorner<3, 3>().trace()));
  }
  CHECK(outcome.first(TrackingStatus::kRelocalised) < kFrames);
  CHECK(outcome.count(TrackingStatus::kLost) <= 32);
  CHECK(outcome.statuses.back() == TrackingStatus::kOk);
  CHECK(outcome.rms_error_m([&](std::size_t i) { return !black(i); }) <
        std::max(0.3, 2.0 * undisturbed().rms_error_m(every)));
}

TEST_CASE("Odometry alone is OK while it measures, and does not claim to know its place after a loss",
          "[stereo_slam][relocalisation]") {
  Slam slam(recording().camera, preset_settings("odometry"));
  constexpr std::size_t kCarried = 20;  // to another street, while the images are black
  auto seen = range(0, 30);
  for (const std::size_t i : range(90, 110)) seen.push_back(i);
  const auto outcome = run({seen,
                            [](std::size_t step, StereoFrame& frame) {
                              if (step >= kCarried && step < 30) blacken(frame);
                            }},
                           slam, 0);
  CAPTURE(outcome.letters());
  CHECK(outcome.letters().substr(0, 32) == "I" + std::string(kCarried - 1, 'O') + std::string(11, 'L') + "W");
  for (std::size_t i = 32; i < seen.size(); ++i) CHECK(outcome.statuses[i] == TrackingStatus::kWeak);
}

TEST_CASE("The paper's filter does not claim to know its place after a loss",
          "[stereo_slam][relocalisation]") {
  const auto slam = make_slam_system(recording().camera, preset_settings("paper"));
  constexpr std::size_t kCarried = 20;  // to another street, while the images are black
  auto seen = range(0, 30);
  for (const std::size_t i : range(90, 110)) seen.push_back(i);
  const auto outcome = run({seen,
                            [](std::size_t step, StereoFrame& frame) {
                              if (step >= kCarried && step < 30) blacken(frame);
                            }},
                           *slam, 0);
  CAPTURE(outcome.letters());
  CHECK(outcome.letters().substr(0, kCarried) == "I" + std::string(kCarried - 1, 'O'));
  for (std::size_t i = 32; i < seen.size(); ++i) CHECK(outcome.statuses[i] == TrackingStatus::kWeak);
}

TEST_CASE("The last keyframe is recognised after three black frames, by odometry alone too",
          "[stereo_slam][relocalisation]") {
  for (const char* preset : {"default", "odometry"}) {
    for (const std::size_t first : {10u, 30u}) {  // on straight streets, where the keyframe stays in view
      Slam slam(recording().camera, preset_settings(preset));
      const auto blacken_three = [&](std::size_t step, StereoFrame& frame) {
        if (step >= first && step < first + 3) blacken(frame);
      };
      const auto outcome = run({range(0, first + 10), blacken_three}, slam, 0);
      CAPTURE(preset, first, outcome.letters(), outcome.errors_m);
      CHECK(outcome.letters() == "I" + std::string(first - 1, 'O') + "LLLR" + std::string(6, 'O'));
      CHECK(outcome.errors_m.back() < 0.1);
    }
  }
}

TEST_CASE("A camera that repeats its image for two seconds is noticed", "[stereo_slam][relocalisation]") {
  auto seen = range(0, kFrames);
  for (std::size_t step = 61; step < 75; ++step) seen[step] = 60;
  const auto outcome = run({seen});
  CAPTURE(outcome.letters(), outcome.errors_m[80], outcome.errors_m.back());
  CHECK(outcome.statuses[61] == TrackingStatus::kWeak);
  for (std::size_t i = 62; i < 75; ++i) CHECK(outcome.statuses[i] == TrackingStatus::kLost);
  CHECK(outcome.statuses[80] == TrackingStatus::kWeak);  // tracked, but where?
  CHECK(outcome.statuses.back() == TrackingStatus::kOk);
  CHECK(outcome.count(TrackingStatus::kLost) <= 15);
  CHECK(outcome.rms_error_m([](std::size_t i) { return i <= 60 || i >= 75; }) <
        std::max(0.3, 2.0 * undisturbed().rms_error_m(every)));
}

TEST_CASE("A camera carried to an earlier street is relocalised", "[stereo_slam][relocalisation]") {
  auto seen = range(0, 130);
  for (const std::size_t i : range(20, 90)) seen.push_back(i);
  const auto outcome = run({seen, [](std::size_t step, StereoFrame& frame) {
                              if (step >= 130) add_noise(frame);
                            }});
  CAPTURE(outcome.letters(), outcome.errors_m[129], outcome.errors_m[150], outcome.errors_m.back());
  CHECK(outcome.statuses[130] == TrackingStatus::kLost);
  const std::size_t found = outcome.first(TrackingStatus::kRelocalised);
  CHECK(found < 140);
  for (std::size_t i = 131; i < found; ++i) CHECK(outcome.statuses[i] == TrackingStatus::kWeak);
  for (std::size_t i = found + 1; i < outcome.statuses.size(); ++i) {
    CHECK(outcome.statuses[i] == TrackingStatus::kOk);
  }
  CHECK(outcome.rms_error_m([](std::size_t i) { return i >= 130; }) < 0.3);
}

TEST_CASE("A surprising pose is not believed in the first frame that is not tracked",
          "[stereo_slam][relocalisation]") {
  // Five images are missing, but no time: the camera jumps, and does not go on as fast as that.
  constexpr std::size_t kJump = 40;
  auto seen = range(0, kJump);
  for (const std::size_t i : range(kJump + 5, 70)) seen.push_back(i);
  const auto outcome = run({seen});
  CAPTURE(outcome.letters(), outcome.errors_m);
  CHECK(outcome.statuses[kJump] == TrackingStatus::kLost);
  CHECK(outcome.statuses[kJump + 1] == TrackingStatus::kRelocalised);
  for (std::size_t i = kJump + 2; i < seen.size(); ++i) CHECK(outcome.statuses[i] == TrackingStatus::kOk);
  CHECK(outcome.errors_m.back() < 0.1);
}

TEST_CASE("Tracking survives jumps of the exposure", "[stereo_slam][relocalisation]") {
  const auto outcome = run({range(0, kFrames), [](std::size_t step, StereoFrame& frame) {
                              constexpr double kGains[] = {1.0, 0.5, 1.6};
                              const double gain = kGains[step / 15 % 3];
                              frame.left.convertTo(frame.left, -1, gain);
                              frame.right.convertTo(frame.right, -1, gain);
                            }});
  CAPTURE(outcome.letters(), outcome.errors_m, undisturbed().rms_error_m(every));
  CHECK(outcome.count(TrackingStatus::kLost) == 0);
  CHECK(outcome.rms_error_m(every) < std::max(0.3, 2.0 * undisturbed().rms_error_m(every)));
}

TEST_CASE("Tracking recovers from frames with left and right swapped", "[stereo_slam][relocalisation]") {
  const auto outcome = run({range(0, kFrames), [](std::size_t step, StereoFrame& frame) {
                              if (step >= 60 && step < 64) std::swap(frame.left, frame.right);
                            }});
  CAPTURE(outcome.letters(), outcome.errors_m, undisturbed().rms_error_m(every));
  CHECK(outcome.statuses[66] == TrackingStatus::kOk);
  CHECK(outcome.rms_error_m(every) < std::max(0.3, 2.0 * undisturbed().rms_error_m(every)));
}

TEST_CASE("A right camera that turns up by half a pixel goes on being used",
          "[stereo_slam][relocalisation]") {
  const auto outcome = run({range(0, 60), [](std::size_t step, StereoFrame& frame) {
                              if (step < 30) return;
                              const cv::Matx23d up(1.0, 0.0, 0.0, 0.0, 1.0, 0.5);
                              cv::warpAffine(frame.right.clone(), frame.right, up, frame.right.size(),
                                             cv::INTER_CUBIC, cv::BORDER_REPLICATE);
                            }});
  CAPTURE(outcome.letters(), outcome.errors_m);
  CHECK(outcome.letters() == "I" + std::string(59, 'O'));
  CHECK(outcome.errors_m.back() < 0.1);
}

TEST_CASE("A second lap from another start is localised in a saved map", "[stereo_slam][relocalisation]") {
  Slam first(recording().camera, Settings{});
  static_cast<void>(run({range(0, 145)}, first, 0));
  const test::TemporaryFolder folder;
  save_map(folder / "streets.map", first.saved_map());
  const SavedMap known = load_map(folder / "streets.map");
  const auto second_lap = range(165, kFramesOfTwoLaps);

  Slam localising(recording().camera, Settings{}, LoopThread::kNone, known, MapUse::kLocalise);
  const auto outcome = run({second_lap}, localising, 0);
  CAPTURE(outcome.letters(), outcome.errors_m);
  CHECK(outcome.first(TrackingStatus::kRelocalised) < 10);
  CHECK(outcome.count(TrackingStatus::kOk) ==
        second_lap.size() - 1 - outcome.first(TrackingStatus::kRelocalised));
  const auto near =
      std::count_if(outcome.errors_m.begin(), outcome.errors_m.end(), [](double e) { return e < 0.2; });
  CHECK(static_cast<double>(near) >= 0.95 * static_cast<double>(second_lap.size()));
  const std::size_t found = outcome.first(TrackingStatus::kRelocalised);
  auto with_repetition = second_lap;
  with_repetition[found] = with_repetition[found - 1];
  Slam hanging(recording().camera, Settings{}, LoopThread::kNone, known, MapUse::kLocalise);
  const auto late = run({with_repetition}, hanging, 0);
  CAPTURE(late.letters());
  CHECK(late.statuses[found] == TrackingStatus::kWeak);
  CHECK(late.statuses[found + 1] == TrackingStatus::kRelocalised);

  const SavedMap after = localising.saved_map();
  for (std::size_t id = 0; id < known.keyframes.size(); ++id) {
    CHECK(after.keyframes[id].T_world_keyframe.pose.coeffs() ==
          known.keyframes[id].T_world_keyframe.pose.coeffs());
  }

  Slam continuing(recording().camera, Settings{}, LoopThread::kOwn, known, MapUse::kContinue);
  const auto continued = run({second_lap}, continuing, 0);
  CAPTURE(continued.letters(), continued.errors_m);
  CHECK(continued.rms_error_m(every) < 0.2);
  save_map(folder / "longer.map", continuing.saved_map());
  const SavedMap longer = load_map(folder / "longer.map");
  CHECK(longer.keyframes.size() > known.keyframes.size());
  CHECK(longer.points.size() > known.points.size());

  Slam again(recording().camera, Settings{}, LoopThread::kNone, longer, MapUse::kLocalise);
  CHECK(run({range(40, 90)}, again, 0).rms_error_m(every) < 0.2);
}

TEST_CASE("The map of a run that ends in an unlocalised segment has all landmarks",
          "[stereo_slam][relocalisation]") {
  auto seen = range(0, 30);
  for (const std::size_t i : range(150, 160)) seen.push_back(i);  // another street, after three black frames
  Slam slam(recording().camera, Settings{});
  const auto outcome = run({seen,
                            [](std::size_t step, StereoFrame& frame) {
                              if (step >= 30 && step < 33) frame.left.setTo(0), frame.right.setTo(0);
                            }},
                           slam, 0);
  CAPTURE(outcome.letters());
  CHECK(outcome.statuses.back() == TrackingStatus::kWeak);
  CHECK(outcome.count(TrackingStatus::kRelocalised) == 0);
  CHECK(slam.map_points().size() > 100);
  CHECK(slam.saved_map().points.size() == slam.map_points().size());
  const test::TemporaryFolder folder;
  save_map(folder / "streets.map", slam.saved_map());
  CHECK(load_map(folder / "streets.map").points.size() == slam.map_points().size());
}

TEST_CASE("A map of two unconnected segments is extended from the second, and connected",
          "[stereo_slam][relocalisation]") {
  auto seen = range(0, 50);
  for (const std::size_t i : range(96, 145)) seen.push_back(i);  // another street, after four black frames
  Slam first(recording().camera, Settings{});
  static_cast<void>(run({seen,
                         [](std::size_t step, StereoFrame& frame) {
                           if (step >= 50 && step < 54) blacken(frame);
                         }},
                        first, 0));
  auto backwards = range(5, 145);
  std::reverse(backwards.begin(), backwards.end());
  Slam extending(recording().camera, Settings{}, LoopThread::kNone, first.saved_map(), MapUse::kContinue);
  const auto outcome = run({backwards}, extending, 0);
  CAPTURE(outcome.letters(), outcome.errors_m);
  CHECK(outcome.statuses.back() == TrackingStatus::kOk);
  CHECK(outcome.errors_m.back() < 0.2);
}

TEST_CASE("A map of another camera is refused, and so are settings that cannot use one",
          "[stereo_slam][relocalisation]") {
  SavedMap known = test::map_of(3, 20);
  StereoCamera other = known.camera;
  other.fx *= 1.1;
  CHECK_THROWS_WITH(Slam(other, Settings{}, LoopThread::kNone, known, MapUse::kLocalise),
                    Catch::Contains("another camera"));
  Settings without;
  without.loop_closure.enabled = false;
  CHECK_THROWS_WITH(Slam(known.camera, without, LoopThread::kNone, known, MapUse::kLocalise),
                    Catch::Contains("loop closure"));
  CHECK_THROWS_AS(Slam(known.camera, without).saved_map(), std::logic_error);
}

}  // namespace
}  // namespace stereo_slam
