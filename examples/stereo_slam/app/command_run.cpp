// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/app/command.hpp"
#include "stereo_slam/app/messages.hpp"
#include "stereo_slam/app/run_json.hpp"
#include "stereo_slam/app/runner.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/results/camera_warnings.hpp"
#include "stereo_slam/results/inertial_warnings.hpp"
#include "stereo_slam/settings/presets.hpp"
#include "stereo_slam/settings/settings_io.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

struct RunArguments {
  DatasetOptions dataset;
  std::optional<fs::path> config;
  std::optional<std::string> preset;
  bool loop_closure = true;
  const CLI::Option* loop_closure_flag = nullptr;  ///< counts whether the flag was given
  bool clahe = false;
  bool imu = false;
  fs::path imu_file;
  RunOptions run;
  std::optional<fs::path> json;
};

void add_settings_options(CLI::App& app, RunArguments& arguments) {
  app.add_option("--config", arguments.config,
                 "file with the settings that differ from the preset; stereo_slam --print-settings lists all "
                 "settings")
      ->check(require_name)
      ->type_name("FILE.yaml");
  let_be_one_of(
      app.add_option("--preset", arguments.preset, "predefined settings to start from; default: default"),
      preset_names());
  arguments.loop_closure_flag = app.add_flag("--loop-closure,!--no-loop-closure", arguments.loop_closure,
                                             "close loops, or do not; default: as in the settings");
  app.add_flag("--clahe", arguments.clahe,
               "equalise the contrast locally; the same as the setting images.clahe: true");
}

void add_imu_options(CLI::App& app, RunArguments& arguments) {
  app.add_flag("--imu", arguments.imu,
               "use the recording's IMU, too: imu0 of EuRoC's layout, imu.csv, or that of a bag");
  app.add_option("--imu-topic", arguments.dataset.imu_topic,
                 "use the IMU in a bag with this topic; needed if there are several")
      ->type_name("TOPIC");
  app.add_option("--imu-file", arguments.imu_file,
                 "use the IMU with these samples: rows of stamp in ns, rates in rad/s, specific forces in "
                 "m/s^2; its description is the .yaml beside it")
      ->check(require_name)
      ->type_name("FILE.csv");
}

[[nodiscard]] bool uses_imu(const RunArguments& arguments) {
  return arguments.imu || !arguments.imu_file.empty() || !arguments.dataset.imu_topic.empty();
}

void add_run_options(CLI::App& app, RunOptions& options, std::optional<fs::path>& json) {
  app.add_option("--output", options.output, "folder for the results")
      ->required()
      ->check(require_name)
      ->type_name("DIR");
  app.add_flag("--overwrite", options.overwrite,
               "replace the results of an earlier run in --output when this run has finished; allow "
               "--save-map, --mcap and --debug-images to replace files of an earlier run");
  app.add_flag("--strict", options.strict,
               "end the run at an image that cannot be read, or that is missing although a list of images "
               "names it, instead of tracking without it");
  app.add_option("--max-frames", options.max_frames, "stop after N frames")
      ->check(whole_number_between(1, 1'000'000'000))
      ->type_name("N");
  app.add_option("--threads", options.threads, "number of threads; the results do not depend on it")
      ->check(whole_number_between(1, 1024))
      ->type_name("N");
  add_pose_frame_option(app, options.pose_frame);
  app.add_option("--save-map", options.save_map, "write the map to this file at the end of the run")
      ->check(require_name)
      ->type_name("FILE");
  app.add_option("--load-map", options.load_map,
                 "localise in the map of an earlier run; with --save-map, extend that map")
      ->check(require_name)
      ->type_name("FILE");
  app.add_option("--learned", options.learned,
                 "begin with what an earlier run learned of the same cameras: the cameras.yaml of its output")
      ->check(require_name)
      ->excludes("--load-map")
      ->type_name("FILE");
  app.add_option("--json", json, "write a summary of the run to this file, for scripts")
      ->check(require_name)
      ->type_name("FILE");
  auto* const mcap =
      app.add_option(
             "--mcap", options.mcap,
             "write poses, covariances, path, landmarks and status as messages of ROS 2 to this file, "
             "for Foxglove, RViz (ros2 bag play) and robot_localization")
          ->check(require_name)
          ->type_name("FILE.mcap");
  app.add_flag("--mcap-images", options.mcap_images, "put a small left image of every frame there, too")
      ->needs(mcap);
  app.add_option("--debug-images", options.debug_images,
                 "folder for one image per frame: predicted and observed flow, search ellipses, matches")
      ->check(require_name)
      ->type_name("DIR");
  app.add_flag("--realtime", options.realtime,
               "play the recording at the speed of its stamps, as a camera would, and drop frames that "
               "arrive while another one is processed; the results then depend on the speed of the machine");
  app.add_flag("--view", options.view,
               "show the images with the landmarks, and the path and the map from above, during the run");
  app.add_flag("--quiet", options.quiet, "print errors only");
}

void warn(const std::string& text, bool quiet) {
  if (!quiet) print_message("warning: " + text);
}

/// Prints the warnings; throws the first error.
void require_usable(const std::vector<Problem>& problems, bool quiet) {
  const auto error = std::ranges::find_if(problems, is_error);
  if (error != problems.end()) throw std::runtime_error(error->text);
  for (const auto& problem : problems) warn(problem.text, quiet);
}

/// Lets the search for matches reach the points that are near. Says so, or what to do if the user has set
/// another range than that of the preset.
void reach_near_points(const StereoAgreement& agreement, int width_px, Settings& settings, bool quiet) {
  const double near_px = agreement.near_disparity_px;
  int& range_px = settings.stereo.max_disparity_px;
  if (!agreement.conclusive() || near_px <= range_px) return;
  const int needed_px = agreement.needed_range_px(width_px);
  if (range_px != preset_settings(settings.preset).stereo.max_disparity_px) {
    warn(fmt::format("10 % of the points have disparities above {:.0f} px, beyond stereo.max_disparity_px, "
                     "which is {}; set it to {}",
                     near_px, range_px, needed_px),
         quiet);
    return;
  }
  warn(fmt::format("10 % of the points have disparities above {:.0f} px, because they are near; "
                   "stereo.max_disparity_px is raised from {} to {} for this run",
                   near_px, range_px, needed_px),
       quiet);
  range_px = needed_px;
}

/// Checks a few stereo pairs before the run: throws if the cameras are swapped, warns if the images do not
/// fit the calibration, and adapts the range of disparities. Returns a delay of the right images.
std::optional<DelayEstimate> check_before_run(const StereoSequence& sequence, Settings& settings,
                                              bool quiet) {
  constexpr std::size_t kSampled = 3;
  std::vector<StereoFrame> frames{load_frame(sequence, 0)};
  std::vector<Problem> ignored;  // an unreadable image ends the run only when the run reaches it
  for (const std::size_t i : spread(sequence.source ? kSampled : sequence.frames.size(), kSampled)) {
    if (i > 0)
      attempt(ignored, Problem::Severity::kWarning, [&] { frames.push_back(load_frame(sequence, i)); });
  }
  const StereoAgreement agreement = check_stereo_agreement(frames);
  const RecordingFindings found = findings_of(agreement, sequence, frames);
  require_usable(found.problems, quiet);
  reach_near_points(agreement, sequence.camera.width_px, settings, quiet);
  return found.right_delay;
}

/// The settings of the preset, the file and the command line. Throws std::runtime_error if --loop-closure is
/// given with a preset that closes no loops.
[[nodiscard]] Settings settings_of(const RunArguments& arguments) {
  Settings settings = arguments.config ? load_settings(*arguments.config, arguments.preset)
                                       : preset_settings(arguments.preset.value_or("default"));
  if (arguments.loop_closure_flag->count() > 0) {
    if (arguments.loop_closure && settings.system == SystemKind::kPaper) {
      throw std::runtime_error(
          "the preset paper has one map without keyframes, and closes no loops; leave out --loop-closure, or "
          "use another preset");
    }
    settings.loop_closure.enabled = arguments.loop_closure;
  }
  settings.images.clahe = settings.images.clahe || arguments.clahe;
  return settings;
}

[[nodiscard]] std::string places_of_files(const RunSummary& summary, const RunOptions& options) {
  std::string places;
  if (summary.map)
    places += fmt::format("; the map is in {}, {} is the earlier one", summary.map->string(),
                          options.save_map->string());
  if (summary.mcap)
    places += fmt::format("; the messages are in {}, {} has those of the earlier run", summary.mcap->string(),
                          options.mcap->string());
  return places;
}

/// Where the results are, if they did not replace those of an earlier run, and where the map is; or
/// `otherwise`.
[[nodiscard]] std::string places_of(const RunSummary& summary, const RunOptions& options,
                                    const std::string& otherwise) {
  std::string places = otherwise;
  if (summary.folder != options.output)
    places = fmt::format("in {}; {} has the results of the earlier run", summary.folder.string(),
                         options.output.string());
  return places + places_of_files(summary, options);
}

/// The error that ended the run, and what is kept of it.
[[nodiscard]] std::string failure_of(const RunSummary& summary, const RunOptions& options) {
  const std::string output = options.output.string();
  if (!summary.folder_in_place) return summary.error + places_of_files(summary, options);
  if (summary.all_frames)
    return fmt::format("{} (the results are {})", summary.error, places_of(summary, options, "in " + output));
  if (summary.saved == 0) {
    const bool earlier = summary.folder != options.output;
    return fmt::format("{} (it ended the run before its first frame{})", summary.error,
                       earlier ? fmt::format("; {} has the results of the earlier run", output) : "");
  }
  return fmt::format("{} (the {} {})", summary.error,
                     counted(summary.saved, "frame before it is", "frames before it are"),
                     places_of(summary, options, "saved"));
}

/// How many frames are WEAK, and the most frequent reasons; empty if none is.
[[nodiscard]] std::string weak_text(const RunSummary& summary) {
  const auto weak = summary.frames_by_status.find(to_string(TrackingStatus::kWeak));
  if (weak == summary.frames_by_status.end()) return "";
  std::vector<std::pair<std::size_t, const char*>> reasons;
  for (std::size_t i = 0; i < kWeakReasons.size(); ++i)
    reasons.emplace_back(summary.weak_frames_by_reason[i], kWeakReasons[i].text);
  std::ranges::stable_sort(reasons, std::greater{}, [](const auto& reason) { return reason.first; });
  constexpr std::size_t kNamed = 3;
  std::string list;
  for (std::size_t i = 0; i < kNamed && reasons[i].first > 0; ++i)
    list += fmt::format("{}{} ({})", i == 0 ? ": " : ", ", reasons[i].second, reasons[i].first);
  return fmt::format("{} of {} frames WEAK{}", weak->second, summary.frames, list);
}

void print_summary(const RunSummary& summary, const RunOptions& options) {
  const FrameCost& cost = summary.frame_cost;
  fmt::print("{} in {:.1f} s, {:.1f} frames per second, {}; results {}\n", counted(summary.frames, "frame"),
             summary.seconds, static_cast<double>(summary.frames) / std::max(summary.seconds, 1e-9),
             counted(summary.landmarks, "landmark"),
             places_of(summary, options, "in " + options.output.string()));
  fmt::print(
      "time per frame: median {:.1f} ms, 95 % below {:.1f} ms, at most {:.1f} ms; CPU {:.1f} ms, and {:.1f} "
      "ms to read its images\n",
      cost.median_ms, cost.p95_ms, cost.max_ms, cost.cpu_ms - cost.read_cpu_ms, cost.read_cpu_ms);
  if (const std::string weak = weak_text(summary); !weak.empty()) fmt::print("{}\n", weak);
  if (!summary.realtime) return;
  fmt::print("real time: {} dropped; latency: median {:.1f} ms, 95 % below {:.1f} ms, at most {:.1f} ms\n",
             counted(summary.realtime->dropped, "frame"), summary.realtime->median_ms,
             summary.realtime->p95_ms, summary.realtime->max_ms);
}

/// What is said of the images that could not be read; empty if there were none.
[[nodiscard]] std::string unreadable_text(const RunSummary& summary) {
  const auto& unreadable = summary.unreadable;
  if (unreadable.empty()) return "";
  const std::string more = unreadable.size() > 1 ? "the first: " : "";
  return fmt::format("{} of the images of {} could not be read, and {} treated as missing{}; {}{}",
                     unreadable.size(), counted(summary.frames, "frame"),
                     unreadable.size() == 1 ? "was" : "were",
                     unreadable.size() > 1 ? " (run.yaml names them)" : "", more, unreadable.front().fault);
}

/// Files that the run reads, besides the images.
[[nodiscard]] std::vector<fs::path> inputs_of(const RunArguments& arguments) {
  std::vector<fs::path> inputs;
  if (arguments.config) inputs.push_back(*arguments.config);
  if (arguments.run.load_map) inputs.push_back(*arguments.run.load_map);
  if (arguments.run.learned) inputs.push_back(*arguments.run.learned);
  for (const auto& file : {arguments.dataset.folder, arguments.dataset.calibration, arguments.imu_file}) {
    if (fs::is_regular_file(file)) inputs.push_back(file);
  }
  return inputs;
}

int run_command(const RunArguments& arguments) {
  const bool quiet = arguments.run.quiet;
  Settings settings = settings_of(arguments);
  if (settings.loop_closure.enabled && settings.system == SystemKind::kPaper)
    warn("no loop is closed, because the preset paper has no keyframes", quiet);
  if (uses_imu(arguments) && settings.system == SystemKind::kPaper)
    warn("the IMU is not used, because the preset paper is the filter of the paper", quiet);
  SequenceScan found = scan(arguments.dataset);
  if (uses_imu(arguments)) add_imu(found, arguments.imu_file);
  require_usable(found.problems, quiet);
  const StereoSequence sequence = std::move(found.sequence);
  RunOptions options = arguments.run;
  options.right_delay = check_before_run(sequence, settings, quiet);
  std::optional<RunJson> json;
  if (arguments.json) json.emplace(*arguments.json, inputs_of(arguments), options);
  RunSummary summary = run(sequence, settings, options);
  if (json) {
    try {
      json->write(summary, sequence, settings);
    } catch (const std::exception& error) {
      if (summary.error.empty()) summary.error = text_of(error);
    }
  }
  if (!quiet) print_summary(summary, arguments.run);
  const std::string early_end = sequence.source ? sequence.source->warning() : "";
  if (!early_end.empty()) warn(early_end, quiet);
  if (const std::string text = unreadable_text(summary); !text.empty() && summary.error.empty())
    warn(text, quiet);
  if (summary.lost > 0 && summary.error.empty()) {
    warn(fmt::format("{} of {} frames could not be tracked; their poses are predictions, see the column "
                     "status of covariances.csv",
                     summary.lost, summary.frames),
         quiet);
  }
  for (const auto& text : camera_warnings(summary)) warn(text, quiet);
  if (summary.inertial) {
    for (const auto& text : inertial_warnings(*summary.inertial, sequence.imu->sensor.known_delay_ns))
      warn(text, quiet);
  }
  constexpr double kNoticeable_s = 0.1;
  if (arguments.run.realtime && summary.realtime->reading_delay_s > kNoticeable_s) {
    warn(fmt::format("images were not read in time, so the last frame was {:.1f} s late; use a faster disk, "
                     "or images that are faster to decode",
                     summary.realtime->reading_delay_s),
         quiet);
  }
  if (!summary.error.empty()) throw std::runtime_error(failure_of(summary, arguments.run));
  return summary.interrupted ? kInterrupted : kDone;
}

}  // namespace

Command add_run(CLI::App& parent) {
  auto arguments = std::make_shared<RunArguments>();
  auto& app =
      *parent.add_subcommand("run", "run the SLAM; write trajectory, covariances, map, timing and a report");
  add_dataset_options(app, arguments->dataset);
  add_settings_options(app, *arguments);
  add_imu_options(app, *arguments);
  add_run_options(app, arguments->run, arguments->json);
  app.footer(
      "Examples:\n"
      "  stereo_slam run --dataset kitti/06 --output out/06\n"
      "  stereo_slam run --dataset euroc/MH_01_easy --output out/MH_01 --pose-frame body\n"
      "  stereo_slam run --dataset drive.bag --output out/drive --json drive.json\n"
      "  stereo_slam run --dataset /dev/video0 --calibration zed.yaml --output out/live     (Ctrl-C ends "
      "it)\n"
      "  stereo_slam run --dataset hall --output out/hall --save-map hall.map");
  return [arguments] { return run_command(*arguments); };
}

}  // namespace stereo_slam
