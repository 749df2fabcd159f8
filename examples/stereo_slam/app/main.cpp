// SPDX-License-Identifier: MIT
// The command line, and nothing else. Exit status: 0 done, 1 the input or the run failed, 2 wrong usage, 130
// interrupted.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ostream.h>
#include <fmt/ranges.h>
#include <opencv2/core/utils/logger.hpp>

#include "simulator/recording/simulate.hpp"
#include "simulator/rendering/lens_view.hpp"
#include "stereo_slam/app/info.hpp"
#include "stereo_slam/app/progress.hpp"
#include "stereo_slam/app/runner.hpp"
#include "stereo_slam/app/signals.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/evaluation/loop_score.hpp"
#include "stereo_slam/evaluation/nees.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/settings/presets.hpp"
#include "stereo_slam/settings/settings_io.hpp"

namespace {

namespace fs = std::filesystem;
using namespace stereo_slam;

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;
constexpr int kInterrupted = 130;

/// What a subcommand does once its options are known.
using Command = std::function<int()>;

/// CLI::Range lets NaN pass.
auto number_between(double least, double most) {
  return [least, most](const std::string& text) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    const bool good = end != text.c_str() && *end == '\0' && value >= least && value <= most;
    return good ? std::string() : fmt::format("{} is no number from {} to {}", text, least, most);
  };
}

void add_dataset_options(CLI::App& app, fs::path& folder, std::string& format) {
  app.add_option("--dataset", folder, "folder of the recording, or the calibration.yaml in it")
      ->required()
      ->type_name("DIR");
  app.add_option("--format", format, "layout of the folder; euroc is that of TUM-VI, too")
      ->check(CLI::IsMember({"kitti", "euroc", "folders", "video", "auto"}))
      ->capture_default_str();
}

void add_pose_frame(CLI::App& app, PoseFrame& frame) {
  app.add_option(
         "--pose-frame", frame,
         "whose poses to write: of the rectified left camera, or of the body (EuRoC: the IMU); default: "
         "camera")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, PoseFrame>{{"camera", PoseFrame::kCamera}, {"body", PoseFrame::kBody}}));
}

void warn(const Problem& problem, bool quiet) {
  if (!quiet) fmt::print(stderr, "stereo_slam: warning: {}\n", problem.text);
}

/// open_sequence that tells the warnings, too.
StereoSequence open_with_warnings(const fs::path& folder, const std::string& format, bool quiet) {
  SequenceScan scan = scan_sequence(folder, format);
  for (const auto& problem : scan.problems) {
    if (is_error(problem)) throw std::runtime_error(problem.text);
  }
  for (const auto& problem : scan.problems) warn(problem, quiet);
  return std::move(scan.sequence);
}

/// Stops a run that could only fail; says what looks odd.
void check_before_run(const StereoSequence& sequence, bool quiet) {
  constexpr std::size_t kSampled = 3;
  std::vector<StereoFrame> frames{load_frame(sequence, 0)};
  std::vector<Problem> ignored;  // a run goes as far as its images do
  for (const std::size_t i : spread(sequence.video ? kSampled : sequence.frames.size(), kSampled)) {
    if (i > 0)
      attempt(ignored, Problem::Severity::kWarning, [&] { frames.push_back(load_frame(sequence, i)); });
  }
  for (const auto& problem : problems_of(check_stereo_agreement(frames), sequence)) {
    if (is_error(problem)) throw std::runtime_error(problem.text);
    warn(problem, quiet);
  }
}

Command add_run(CLI::App& parent) {
  struct Arguments {
    fs::path dataset;
    std::string format = "auto";
    std::optional<fs::path> config;
    std::optional<std::string> preset;
    bool loop_closure = true;
    bool clahe = false;
    RunOptions options;
  };
  auto args = std::make_shared<Arguments>();
  auto& app =
      *parent.add_subcommand("run", "track a recording and write trajectory, covariances, map and timing");
  add_dataset_options(app, args->dataset, args->format);
  app.add_option("--config", args->config, "settings that differ from the preset; see --print-settings")
      ->type_name("FILE.yaml");
  app.add_option("--preset", args->preset, "values to start from; default: default")
      ->check(CLI::IsMember(preset_names()));
  app.add_option("--output", args->options.output, "folder for the results")->required()->type_name("DIR");
  app.add_option("--max-frames", args->options.max_frames, "stop after N frames")
      ->check(CLI::PositiveNumber)
      ->type_name("N");
  const auto* loop_closure = app.add_flag(
      "--loop-closure,!--no-loop-closure", args->loop_closure,
      "recognise places seen before and correct the drift, or not; default: as the settings say");
  app.add_option("--threads", args->options.threads,
                 "threads for image processing; the results do not depend on it")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  add_pose_frame(app, args->options.pose_frame);
  app.add_option("--save-map", args->options.save_map, "write the map at the end, for a later run")
      ->type_name("FILE");
  app.add_option("--load-map", args->options.load_map,
                 "find the place in the map of an earlier run; together with --save-map, continue it")
      ->type_name("FILE");
  app.add_flag("--clahe", args->clahe,
               "equalise the contrast locally, as images.clahe: true in the settings");
  app.add_option("--debug-images", args->options.debug_images,
                 "folder for pictures of every frame: predicted and observed flow, search ellipses, matches")
      ->type_name("DIR");
  app.add_flag("--view", args->options.view, "show the images with the map's points while running");
  app.add_flag("--quiet", args->options.quiet, "print errors only");
  return [args, loop_closure] {
    Settings settings = args->config ? load_settings(*args->config, args->preset)
                                     : preset_settings(args->preset.value_or("default"));
    if (loop_closure->count() > 0) settings.loop_closure.enabled = args->loop_closure;
    settings.images.clahe = settings.images.clahe || args->clahe;
    const StereoSequence sequence = open_with_warnings(args->dataset, args->format, args->options.quiet);
    check_before_run(sequence, args->options.quiet);
    const RunSummary summary = run(sequence, settings, args->options);
    if (!args->options.quiet) {
      fmt::print(
          "{} frames in {:.1f} s, {:.1f} frames a second (median {:.1f} ms a frame), {} landmarks; results "
          "in {}\n",
          summary.frames, summary.seconds,
          static_cast<double>(summary.frames) / std::max(summary.seconds, 1e-9), summary.median_ms,
          summary.landmarks, args->options.output.string());
    }
    if (summary.lost > 0 && !args->options.quiet) {
      fmt::print(stderr,
                 "stereo_slam: warning: {} of {} frames could not be tracked; their poses are guesses, see "
                 "the status in covariances.csv\n",
                 summary.lost, summary.frames);
    }
    if (!summary.error.empty()) {
      throw std::runtime_error(
          fmt::format("{} (the {} frames before it are saved)", summary.error, summary.frames));
    }
    return summary.interrupted ? kInterrupted : kDone;
  };
}

Command add_evaluate(CLI::App& parent) {
  struct Arguments {
    fs::path truth;
    fs::path estimate;
    std::optional<TrajectoryFormat> format;
    double max_difference_s = 0.01;
    std::optional<fs::path> json;
    std::optional<fs::path> covariances;
    double truth_sigma_m = 0.0;
    double truth_sigma_deg = 0.0;
    std::optional<fs::path> loops;
    RevisitRule revisits;
  };
  auto args = std::make_shared<Arguments>();
  auto& app = *parent.add_subcommand("evaluate", "score an estimated trajectory against the truth");
  app.add_option("--groundtruth", args->truth, "true trajectory")->required()->type_name("FILE");
  app.add_option("--estimate", args->estimate, "estimated trajectory")->required()->type_name("FILE");
  app.add_option("--format", args->format, "of both files; without it each is recognised by its columns")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, TrajectoryFormat>{{"kitti", TrajectoryFormat::kKitti},
                                                  {"tum", TrajectoryFormat::kTum},
                                                  {"euroc", TrajectoryFormat::kEuroc}}));
  app.add_option("--max-time-difference", args->max_difference_s, "seconds between poses that may be matched")
      ->check(number_between(0.0, 1e6))
      ->capture_default_str()
      ->type_name("S");
  app.add_option("--json", args->json, "write the scores here as well")->type_name("FILE");
  app.add_option("--covariances", args->covariances,
                 "covariances.csv of the run: say whether its errors are as large as they claim")
      ->type_name("FILE");
  app.add_option("--truth-sigma-m", args->truth_sigma_m, "noise of the true relative positions, per axis")
      ->check(number_between(0.0, 1e6))
      ->capture_default_str();
  app.add_option("--truth-sigma-deg", args->truth_sigma_deg, "noise of the true relative rotations, per axis")
      ->check(number_between(0.0, 1e6))
      ->capture_default_str();
  app.add_option("--loops", args->loops,
                 "loops.csv of the run: say which are true, and which places seen again they found")
      ->type_name("FILE");
  app.add_option("--min-gap-frames", args->revisits.min_gap_frames,
                 "frames after which a place may count as seen again, as place_recognition.min_gap_frames")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str()
      ->type_name("N");
  return [args] {
    const Trajectory truth = read_trajectory(args->truth, args->format);
    const Trajectory estimate = read_trajectory(args->estimate, args->format);
    const Evaluation evaluation = evaluate(truth, estimate, args->max_difference_s);
    print_evaluation(std::cout, evaluation);
    const FramePairs pairs = match_poses(truth, estimate, args->max_difference_s);
    std::vector<std::string> members;
    if (args->covariances) {
      constexpr double kRadians = std::numbers::pi / 180.0;
      const Consistency consistency =
          score_consistency(truth, estimate, pairs, read_covariances(*args->covariances),
                            {args->truth_sigma_m, kRadians * args->truth_sigma_deg});
      print_consistency(std::cout, consistency);
      members.push_back("\"consistency\": " + consistency_json(consistency));
    }
    if (args->loops) {
      const LoopScore loops = score_loops(poses_at_frames(truth, pairs, estimate.poses.size()),
                                          read_loops(*args->loops), args->revisits);
      print_loop_score(std::cout, loops);
      members.push_back("\"loops\": " + loop_score_json(loops));
    }
    if (args->json) {
      write_file(*args->json, [&](std::ostream& out) {
        write_evaluation_json(out, evaluation, fmt::format("{}", fmt::join(members, ",\n  ")));
      });
    }
    return kDone;
  };
}

Command add_info(CLI::App& parent) {
  struct Arguments {
    fs::path dataset;
    std::string format = "auto";
    std::optional<fs::path> truth;
    PoseFrame pose_frame = PoseFrame::kCamera;
  };
  auto args = std::make_shared<Arguments>();
  auto& app = *parent.add_subcommand("info", "say what a recording consists of and what is wrong with it");
  add_dataset_options(app, args->dataset, args->format);
  app.add_option("--write-groundtruth", args->truth, "write the true trajectory here, in TUM format")
      ->type_name("FILE");
  add_pose_frame(app, args->pose_frame);
  return [args] {
    const Inspection inspection = inspect_sequence(args->dataset, args->format);
    print_inspection(std::cout, inspection);
    const auto& problems = inspection.scan.problems;
    const auto error = std::find_if(problems.begin(), problems.end(), is_error);
    if (error != problems.end()) throw std::runtime_error(error->text);
    if (args->truth) {
      write_file(*args->truth, [&](std::ostream& out) {
        write_ground_truth(out, inspection.scan.sequence, args->pose_frame);
      });
    }
    return kDone;
  };
}

/// The same view in an image of another size; pixel centres have integer coordinates.
simulator::PinholeCamera scaled(const simulator::PinholeCamera& camera, double scale) {
  return {.width_px = static_cast<int>(std::lround(camera.width_px * scale)),
          .height_px = static_cast<int>(std::lround(camera.height_px * scale)),
          .fx = camera.fx * scale,
          .fy = camera.fy * scale,
          .cx = (camera.cx + 0.5) * scale - 0.5,
          .cy = (camera.cy + 0.5) * scale - 0.5};
}

Command add_simulate(CLI::App& parent) {
  struct Arguments {
    fs::path output;
    double scale = 1.0;
    bool quiet = false;
    std::string format = "kitti";
    std::optional<Distortion> distortion;
    simulator::SimulationSettings settings;
  };
  auto args = std::make_shared<Arguments>();
  auto& settings = args->settings;
  auto& app = *parent.add_subcommand(
      "simulate", "render a town or a highway as a KITTI or EuRoC sequence with ground truth");
  app.add_option("--output", args->output, "folder for the sequence")->required()->type_name("DIR");
  app.add_option("--trajectory", settings.trajectory,
                 "KITTI pose file to drive along; without it a loop of streets, or a highway")
      ->type_name("POSES");
  app.add_option("--scene", settings.scenery,
                 "what is built along it: town, or highway, where most things are far; default: town")
      ->transform(CLI::CheckedTransformer(std::map<std::string, simulator::Scenery>{
          {"town", simulator::Scenery::kTown}, {"highway", simulator::Scenery::kHighway}}));
  app.add_option(
         "--frames", settings.frames,
         fmt::format("how many; default: all of the file, or {} of the own drive", settings.kDefaultFrames))
      ->check(CLI::Range(2, 1'000'000))
      ->type_name("N");
  app.add_option("--seed", settings.seed, "of the world, the traffic and the noise")
      ->capture_default_str()
      ->type_name("S");
  app.add_option("--dynamic-objects", settings.dynamic_objects,
                 "moving cars and lorries, ahead and oncoming; 40 make a jam")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str()
      ->type_name("N");
  app.add_flag("--moving-masks", settings.moving_masks,
               "also write which pixels of the left images show them, in the folder moving");
  app.add_option("--fps", settings.fps, "frames a second")
      ->check(number_between(0.1, 1000.0))
      ->capture_default_str();
  app.add_option("--scale", args->scale,
                 "size of the images as a share of KITTI's 1241 x 376, EuRoC's 752 x 480")
      ->check(number_between(0.1, 4.0))
      ->capture_default_str();
  app.add_option("--format", args->format, "kitti: rectified images; euroc: raw images of two unlike lenses")
      ->check(CLI::IsMember({"kitti", "euroc"}))
      ->capture_default_str();
  app.add_option("--distortion", args->distortion, "of the lenses, with --format euroc; default: radtan")
      ->transform(CLI::CheckedTransformer(std::map<std::string, Distortion>{
          {"radtan", Distortion::kRadTan}, {"equidistant", Distortion::kEquidistant}}));
  app.parse_complete_callback([args] {
    if (args->distortion && args->format != "euroc")
      throw CLI::ValidationError("--distortion", "needs --format euroc");
  });
  app.add_option("--noise", settings.sensor.noise_sigma, "of a pixel, grey levels")
      ->check(number_between(0.0, 50.0))
      ->capture_default_str();
  app.add_option("--threads", settings.threads, "0: one a processor; the images do not depend on it")
      ->check(CLI::Range(0, 1024))
      ->type_name("N");
  app.add_flag("--quiet", args->quiet, "print errors only");
  return [args] {
    args->settings.camera = scaled(args->settings.camera, args->scale);
    if (args->format == "euroc")
      args->settings.rig =
          simulator::euroc_like_rig(args->distortion.value_or(Distortion::kRadTan), args->scale);
    const SignalGuard signals;
    Progress progress(args->quiet);
    simulator::simulate(args->settings, args->output, [&](int done, int total) {
      progress.update(static_cast<std::size_t>(done), static_cast<std::size_t>(total), "rendered");
      return !SignalGuard::stop_requested();
    });
    return SignalGuard::stop_requested() ? kInterrupted : kDone;
  };
}

/// OpenCV and its decoders complain on stderr, through std::cerr for one, about what then becomes an error of
/// ours, of one line on the C stream. Who asks them to speak by their own variables is heard.
void silence_decoders() {
  if (std::getenv("OPENCV_LOG_LEVEL") == nullptr) {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    std::cerr.setstate(std::ios::badbit);
  }
  constexpr const char* kQuiet = "-8";
  setenv("OPENCV_FFMPEG_LOGLEVEL", kQuiet, /*overwrite=*/0);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Stereo visual SLAM with dual quaternions and Bingham densities.", "stereo_slam");
  app.set_version_flag("--version", STEREO_SLAM_VERSION);
  app.require_subcommand(0, 1);
  std::string printed_preset;
  auto* print_settings =
      app.add_option("--print-settings", printed_preset, "print a preset as a settings file")
          ->expected(0, 1)
          ->check(CLI::IsMember(preset_names()))
          ->type_name("PRESET");
  const std::map<std::string, Command> commands = {{"run", add_run(app)},
                                                   {"evaluate", add_evaluate(app)},
                                                   {"simulate", add_simulate(app)},
                                                   {"info", add_info(app)}};

  try {
    app.parse(argc, argv);
    if (app.get_subcommands().empty() && print_settings->count() == 0) {
      throw CLI::RequiredError("one of the commands run, evaluate, simulate, info");
    }
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kWrongUsage;
  }

  silence_decoders();
  try {
    if (app.get_subcommands().empty()) {
      write_settings(std::cout, preset_settings(printed_preset.empty() ? "default" : printed_preset));
      return kDone;
    }
    const int status = commands.at(app.get_subcommands().front()->get_name())();
    std::cout.flush();
    if (!std::cout || std::fflush(stdout) != 0) throw std::runtime_error("standard output cannot be written");
    return status;
  } catch (const std::exception& error) {
    fmt::print(stderr, "stereo_slam: {}\n", error.what());
    return kFailed;
  }
}
