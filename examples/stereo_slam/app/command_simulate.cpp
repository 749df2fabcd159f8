// SPDX-License-Identifier: MIT
#include <charconv>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "simulator/recording/simulate.hpp"
#include "simulator/rendering/lens_view.hpp"
#include "stereo_slam/app/command.hpp"
#include "stereo_slam/app/messages.hpp"
#include "stereo_slam/app/progress.hpp"
#include "stereo_slam/app/signals.hpp"

namespace stereo_slam {
namespace {

struct SimulateArguments {
  std::filesystem::path output;
  double scale = 1.0;
  double exposure_ms = 0.0;
  double sync_error_ms = 0.0;
  double bounce_mm = 0.0;
  double imu_delay_ms = 0.0;
  bool with_imu = false;
  simulator::ImuSettings imu;
  bool quiet = false;
  std::string format = "kitti";
  std::optional<Distortion> distortion;
  simulator::SimulationSettings settings;
};

/// A number of a list, with the range that it is checked for.
struct ListedNumber {
  double* value;
  double least;
  double most;
};

/// Adds an option that takes `needed` or more numbers, separated by commas.
CLI::Option* add_list_option(CLI::App& app, const std::string& name, const std::vector<ListedNumber>& numbers,
                             std::size_t needed, const std::string& description) {
  const auto read = [=](const std::string& text) {
    const auto items = CLI::detail::split(text, ',');
    if (items.size() < needed || items.size() > numbers.size())
      throw CLI::ValidationError(
          name,
          needed == numbers.size()
              ? fmt::format("{} is not {} numbers separated by a comma", text, needed)
              : fmt::format("{} is not {} to {} numbers separated by commas", text, needed, numbers.size()));
    for (std::size_t i = 0; i < items.size(); ++i) {
      const auto& [value, least, most] = numbers[i];
      const std::string error = number_between(least, most)(items[i]);
      if (!error.empty()) throw CLI::ValidationError(name, error);
      std::from_chars(items[i].data(), items[i].data() + items[i].size(), *value);
    }
  };
  return app.add_option_function<std::string>(name, read, description);
}

void add_scene_options(CLI::App& app, simulator::SimulationSettings& settings) {
  app.add_option("--trajectory", settings.trajectory,
                 "KITTI pose file with the path of the camera; default: a path through the scene")
      ->check(require_name)
      ->type_name("POSES");
  let_be_one_of<simulator::Scenery>(
      app.add_option("--scene", settings.scenery,
                     "scene along the path: town; highway, where most points are far; fences, where pickets "
                     "and windows repeat; snow, with little texture; default: town"),
      {{"town", simulator::Scenery::kTown},
       {"highway", simulator::Scenery::kHighway},
       {"fences", simulator::Scenery::kFences},
       {"snow", simulator::Scenery::kSnow}});
  app.add_option("--frames", settings.frames,
                 fmt::format("number of frames, the first ones of --trajectory; default: all of "
                             "--trajectory, or {} without it",
                             settings.kDefaultFrames))
      ->check(whole_number_between(2, 100'000))
      ->type_name("N");
  app.add_option("--seed", settings.seed, "seed of the scene, the traffic and the noise")
      ->check(whole_number_between(0, std::numeric_limits<std::uint64_t>::max()))
      ->capture_default_str()
      ->type_name("S");
  app.add_option("--dynamic-objects", settings.dynamic_objects,
                 "number of moving cars and lorries, ahead and oncoming; 40 make a traffic jam")
      ->check(whole_number_between(0, 1000))
      ->capture_default_str()
      ->type_name("N");
  app.add_flag("--moving-masks", settings.moving_masks,
               "also write masks of the moving objects in the left images, to the folder moving");
}

/// What real rigs do that their calibrations do not say.
void add_rig_options(CLI::App& app, SimulateArguments& arguments) {
  simulator::SimulationSettings& settings = arguments.settings;
  app.add_option(
         "--rectification-error", settings.rectification_error_px,
         "error of the right camera's calibration (rotation, principal point and radial distortion), as "
         "its largest displacement in pixels at scale 1; with --format kitti")
      ->check(number_between(0.0, 20.0))
      ->type_name("PX");
  add_list_option(app, "--lens-error",
                  {{&settings.lens_error.k1, -1.0, 1.0}, {&settings.lens_error.k2, -1.0, 1.0}}, 2,
                  "radial distortion left in both rectified images: a point at the radius r (in focal "
                  "lengths) is seen at r (1 + K1 r^2 + K2 r^4); -.026,.013 is KITTI's; with --format kitti")
      ->type_name("K1,K2");
  simulator::RigDisturbance& disturbance = settings.disturbance;
  add_list_option(app, "--rig-vibration",
                  {{&disturbance.vibration_px, 0.0, 20.0}, {&disturbance.vibration_frames, 0.0, 1e6}}, 1,
                  "the right camera turns anew in every frame; standard deviation of the "
                  "displacement in u in pixels at scale 1 (.3 of it in v, and by roll), and correlation time")
      ->type_name("PX[,FRAMES]");
  app.add_option(
         "--ride", arguments.bounce_mm,
         "bounce of a vehicle on a bad road, with pitch and roll; standard deviation in millimetres. 17 "
         "turn the camera by 10 pixels of pitch from frame to frame. The ground truth contains it")
      ->check(number_between(0.0, 200.0))
      ->type_name("MM");
  app.add_option("--rig-drift", disturbance.drift_px,
                 "slow rotation of the right camera: none in the first frame, and in the last one that with "
                 "this displacement in u in pixels at scale 1 (.3 of it in v, and by roll)")
      ->check(number_between(-20.0, 20.0))
      ->type_name("PX");
  app.add_option("--sync-error", arguments.sync_error_ms,
                 "time by which the right image is exposed later than the left one, in milliseconds")
      ->check(number_between(-1000.0, 1000.0))
      ->type_name("MS");
}

void add_imu_options(CLI::App& app, SimulateArguments& arguments) {
  simulator::ImuSettings& imu = arguments.imu;
  auto* with_imu =
      app.add_flag("--imu", arguments.with_imu,
                   "also write the readings of an inertial measurement unit: imu.csv and imu.yaml in "
                   "the axes of the left camera, or imu0 with --format euroc");
  app.add_option("--imu-rate", imu.rate_hz, "its samples per second")
      ->check(number_between(10.0, 10'000.0))
      ->capture_default_str()
      ->needs(with_imu)
      ->type_name("HZ");
  const auto add_pair = [&](const char* name, double& gyroscope, double& accelerometer, double least,
                            double most, const std::string& description) {
    add_list_option(app, name, {{&gyroscope, least, most}, {&accelerometer, least, most}}, 2, description)
        ->needs(with_imu)
        ->type_name("GYRO,ACCEL");
  };
  add_pair("--imu-noise", imu.gyroscope_noise, imu.accelerometer_noise, 0.0, 1.0,
           "its noise densities, in rad/s/sqrt(Hz) and m/s^2/sqrt(Hz); default: 1.7e-4,2e-3");
  add_pair("--imu-walk", imu.gyroscope_walk, imu.accelerometer_walk, 0.0, 1.0,
           "random walks of its biases, in rad/s^2/sqrt(Hz) and m/s^3/sqrt(Hz); default: 2e-5,3e-3");
  add_pair("--imu-bias", imu.gyroscope_bias, imu.accelerometer_bias, 0.0, 1.0,
           "standard deviations of its biases at the start, in rad/s and m/s^2; default: .05,.1");
  add_pair("--imu-range", imu.gyroscope_range, imu.accelerometer_range, 1e-3, 1e6,
           "largest readings, in rad/s and m/s^2; larger ones are cut off there; default: no limit");
  app.add_option("--imu-delay", arguments.imu_delay_ms,
                 "time by which its stamps are later than those of the images, in milliseconds")
      ->check(number_between(-1000.0, 1000.0))
      ->needs(with_imu)
      ->type_name("MS");
}

void add_recording_options(CLI::App& app, SimulateArguments& arguments) {
  app.add_option("--fps", arguments.settings.fps, "frames per second")
      ->check(number_between(0.1, 1000.0))
      ->capture_default_str();
  app.add_option("--scale", arguments.scale,
                 "size of the images relative to KITTI's 1241 x 376 or EuRoC's 752 x 480")
      ->check(number_between(0.1, 4.0))
      ->capture_default_str();
  let_be_one_of(
      app.add_option("--format", arguments.format,
                     "kitti: rectified images; euroc: raw images of two different lenses; default: kitti"),
      {"kitti", "euroc"});
  let_be_one_of<Distortion>(
      app.add_option("--distortion", arguments.distortion, "lens model with --format euroc; default: radtan"),
      {{"radtan", Distortion::kRadTan}, {"equidistant", Distortion::kEquidistant}});
  app.add_option("--noise", arguments.settings.sensor.noise_sigma,
                 "standard deviation of the pixel noise, in grey levels")
      ->check(number_between(0.0, 50.0))
      ->capture_default_str();
  app.add_option("--exposure", arguments.exposure_ms,
                 "time in which the light of an image is collected, in milliseconds; longer ones blur images "
                 "by motion")
      ->check(number_between(0.0, 1000.0))
      ->capture_default_str()
      ->type_name("MS");
  app.add_option("--threads", arguments.settings.threads,
                 "number of threads; 0 is one per processor; the images do not depend on it")
      ->check(whole_number_between(0, 1024))
      ->type_name("N");
  app.add_flag("--quiet", arguments.quiet, "print errors only");
}

int simulate_command(const SimulateArguments& arguments) {
  simulator::SimulationSettings settings = arguments.settings;
  settings.camera = scaled(settings.camera, arguments.scale);
  settings.rectification_error_px *= arguments.scale;
  settings.disturbance.vibration_px *= arguments.scale;
  settings.disturbance.drift_px *= arguments.scale;
  settings.ride.bounce_m = 1e-3 * arguments.bounce_mm;
  settings.disturbance.sync_error_s = 1e-3 * arguments.sync_error_ms;
  settings.sensor.exposure_s = 1e-3 * arguments.exposure_ms;
  if (arguments.with_imu) {
    settings.imu = arguments.imu;
    settings.imu->delay_s = 1e-3 * arguments.imu_delay_ms;
  }
  if (arguments.format == "euroc") {
    settings.rig =
        simulator::euroc_like_rig(arguments.distortion.value_or(Distortion::kRadTan), arguments.scale);
  }
  if (!arguments.quiet) {
    for (const auto& remark : simulator::trajectory_remarks(settings)) print_message("warning: " + remark);
  }
  const SignalGuard signals;
  Progress progress(arguments.quiet);
  simulator::simulate(settings, arguments.output, [&](int done, int total) {
    progress.update(static_cast<std::size_t>(done), static_cast<std::size_t>(total), "rendered");
    return !SignalGuard::stop_requested();
  });
  return SignalGuard::stop_requested() ? kInterrupted : kDone;
}

}  // namespace

Command add_simulate(CLI::App& parent) {
  auto arguments = std::make_shared<SimulateArguments>();
  auto& app =
      *parent.add_subcommand("simulate", "render a street as a KITTI or EuRoC sequence with ground truth");
  app.add_option("--output", arguments->output, "folder for the sequence")
      ->required()
      ->check(require_name)
      ->type_name("DIR");
  add_scene_options(app, arguments->settings);
  add_recording_options(app, *arguments);
  add_rig_options(app, *arguments);
  add_imu_options(app, *arguments);
  app.parse_complete_callback([arguments] {
    if (arguments->distortion && arguments->format != "euroc")
      throw CLI::ValidationError("--distortion", "needs --format euroc");
    if (arguments->settings.rectification_error_px > 0.0 && arguments->format != "kitti")
      throw CLI::ValidationError("--rectification-error", "needs --format kitti");
    if (arguments->settings.lens_error.any() && arguments->format != "kitti")
      throw CLI::ValidationError("--lens-error", "needs --format kitti");
    try {
      validate(arguments->settings.lens_error, arguments->settings.camera);
    } catch (const std::invalid_argument& error) {
      throw CLI::ValidationError("--lens-error", error.what());
    }
    if (1e-3 * arguments->exposure_ms * arguments->settings.fps > 1.0)
      throw CLI::ValidationError("--exposure", "is longer than the time between two frames (--fps)");
  });
  app.footer(
      "Examples:\n"
      "  stereo_slam simulate --output town --frames 300\n"
      "  stereo_slam simulate --output raw --format euroc --distortion equidistant --frames 100");
  return [arguments] { return simulate_command(*arguments); };
}

}  // namespace stereo_slam
