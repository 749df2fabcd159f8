// SPDX-License-Identifier: MIT
#include "stereo_slam/app/runner.hpp"

#include <array>
#include <cmath>
#include <functional>

#include <yaml-cpp/yaml.h>

#include "stereo_slam/app/process_usage.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/report/page_data.hpp"
#include "stereo_slam/settings/presets.hpp"
#include "stereo_slam/settings/settings_io.hpp"
#include "stereo_slam/support/support.hpp"
#include "stereo_slam/support/tiny_video.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

RunSummary run_quietly(const fs::path& dataset, const fs::path& output,
                       std::optional<int> threads = std::nullopt) {
  return run(open_sequence(dataset, "auto"), Settings{},
             {.output = output, .max_frames = std::nullopt, .threads = threads, .quiet = true});
}

void check_report(const fs::path& output, std::size_t frames) {
  const auto data = page_data(read_text(output / "report.html"));
  CHECK(data["frame_count"] == frames);
  CHECK(data["thumbnails"].size() == (frames + 3) / 4);
}

/// Every result file holds exactly `frames` frames.
void check_results(const fs::path& output, std::size_t frames) {
  for (const auto* name : {"trajectory_kitti.txt", "trajectory_tum.txt", "trajectory_online.txt"}) {
    CAPTURE(name);
    CHECK(read_trajectory(output / name).poses.size() == frames);
  }
  for (const auto* name : {"covariances.csv", "timing.csv"}) {
    CAPTURE(name);
    const auto lines = split_lines(read_text(output / name));
    CHECK(lines.size() == frames + 1);
    for (const auto& line : lines) {
      CHECK(std::count(line.begin(), line.end(), ',') == std::count(lines[0].begin(), lines[0].end(), ','));
    }
  }
  CHECK_THAT(read_text(output / "map.ply"), Catch::StartsWith("ply\n"));
  check_report(output, frames);
}

}  // namespace

TEST_CASE("Every result file of a run has every frame", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 8);
  const auto summary = run_quietly(folder / "in", folder / "out");
  CHECK(summary.error.empty());
  CHECK_FALSE(summary.interrupted);
  CHECK(summary.frames == 8);
  CHECK(summary.frame_cost.median_ms > 0.0);
  check_results(folder / "out", 8);
  CHECK_THAT(read_text(folder / "out/run.yaml"),
             Catch::Contains("state: finished") && Catch::Contains("frames_processed: 8"));
  CHECK(load_settings(folder / "out/run.yaml").preset == "default");
}

TEST_CASE("An image that cannot be read ends a strict run; the frames before it are saved", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 8);
  fs::remove(folder / "in/image_1/000005.png");
  RunOptions options{
      .output = folder / "out", .max_frames = std::nullopt, .threads = std::nullopt, .quiet = true};
  options.strict = true;
  const auto summary = run(open_sequence(folder / "in", "auto"), Settings{}, options);
  CHECK(summary.frames == 5);
  CHECK_THAT(summary.error, Catch::Contains("image_1/000005.png: missing"));
  check_results(folder / "out", 5);
  CHECK_THAT(page_data(read_text(folder / "out/report.html"))["error"].get<std::string>(),
             Catch::Contains("image_1/000005.png: missing"));
  CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("state: failed"));
}

namespace {

/// The statuses in covariances.csv, one letter a frame: IOWLR.
std::string statuses(const fs::path& output) {
  std::string letters;
  const auto lines = split_lines(read_text(output / "covariances.csv"));
  for (std::size_t i = 1; i < lines.size(); ++i) letters += lines[i].at(lines[i].find(',') + 1);
  return letters;
}

/// The reasons of a frame in covariances.csv.
std::string reasons(const fs::path& output, std::size_t frame) {
  const auto line = split_lines(read_text(output / "covariances.csv")).at(frame + 1);
  return line.substr(line.rfind(',') + 1);
}

}  // namespace

TEST_CASE("An image that cannot be read costs its own frame only, whatever is wrong with it", "[runner]") {
  using Break = std::function<void(const fs::path&)>;
  const std::vector<std::pair<std::string, Break>> kinds = {
      {"missing", [](const fs::path& file) { fs::remove(file); }},
      {"the file is empty", [](const fs::path& file) { write_text(file, ""); }},
      {"the PNG is truncated", [](const fs::path& file) { truncate_file(file, 0.5); }},
      {"damaged (checksum)",
       [](const fs::path& file) {
         std::string bytes = read_text(file);
         bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
         write_text(file, bytes);
       }},
      {"is 100x120 pixels", [](const fs::path& file) { cv::imwrite(file.string(), tiny_texture(100)); }},
      {"cannot be read", [](const fs::path& file) { fs::remove(file), fs::create_directory(file); }}};
  for (const auto& [text, damage] : kinds) {
    CAPTURE(text);
    const TemporaryFolder folder;
    write_tiny_sequence(folder / "in", 10);
    damage(folder / "in/image_1/000003.png");
    damage(folder / "in/image_0/000006.png");
    const auto summary = run_quietly(folder / "in", folder / "out");
    CHECK(summary.error.empty());
    check_results(folder / "out", 10);
    REQUIRE(summary.unreadable.size() == 2);
    CHECK(summary.unreadable[0].frame == 3);
    CHECK(summary.unreadable[1].frame == 6);
    CHECK_THAT(summary.unreadable[0].fault, Catch::Contains("image_1/000003.png: ") && Catch::Contains(text));
    CHECK_THAT(summary.unreadable[1].fault, Catch::Contains("image_0/000006.png: ") && Catch::Contains(text));
    CHECK(statuses(folder / "out") == "IOOWOOLOOO");
    CHECK(summary.right_image_misfits.empty());
    CHECK(reasons(folder / "out", 3) == "right_image_unfit");
    CHECK(reasons(folder / "out", 4).empty());
    CHECK(summary.weak_frames_by_reason == ReasonCounts{0, 0, 0, 0, 0, 0, 1, 0, 0});
    CHECK_THAT(read_text(folder / "out/run.yaml"),
               Catch::Contains("weak_frames_by_reason: {right_image_unfit: 1}\n"));
    CHECK(page_data(read_text(folder / "out/report.html"))["unreadable_images"] == 2);
    const auto poses = read_trajectory(folder / "out/trajectory_kitti.txt").poses;
    for (std::size_t i = 0; i < poses.size(); ++i)
      CHECK(poses[i].translation().x() == Approx(0.16 * static_cast<double>(i)).margin(0.02));
  }
}

TEST_CASE("Also every second image, and all from one on, cost their own frames only", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "second", 10);
  for (int i = 1; i < 10; i += 2) fs::remove(folder / "second/image_0" / frame_name(i));
  const auto every_second = run_quietly(folder / "second", folder / "out1");
  CHECK(every_second.error.empty());
  CHECK(statuses(folder / "out1") == "ILOLOLOLOL");
  write_tiny_sequence(folder / "last", 10);
  for (int i = 7; i < 10; ++i) fs::remove(folder / "last/image_1" / frame_name(i));
  const auto last = run_quietly(folder / "last", folder / "out2");
  CHECK(last.error.empty());
  CHECK(statuses(folder / "out2") == "IOOOOOOWWW");
  CHECK(last.unreadable.size() == 3);
}

TEST_CASE("Without a map, or by odometry alone, a frame without its right image is a gap", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 8);
  const auto sequence = open_sequence(folder / "in", "auto");
  for (const int i : {0, 1, 5}) fs::remove(folder / "in/image_1" / frame_name(i));
  const auto run_with = [&](const std::string& preset) {
    RunOptions options{.output = folder / preset, .max_frames = std::nullopt, .threads = 1, .quiet = true};
    CHECK(run(sequence, preset_settings(preset), options).error.empty());
    return statuses(folder / preset);
  };
  CHECK(run_with("default") == "LLIOOWOO");
  CHECK(run_with("odometry") == "LLIOOLOO");
}

TEST_CASE("A recording of one image is not called tracked", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 6);
  for (int i = 1; i < 6; ++i) {
    for (const auto* camera : {"image_0", "image_1"}) {
      const fs::path images = folder / "in" / camera;
      fs::copy_file(images / frame_name(0), images / frame_name(i), fs::copy_options::overwrite_existing);
    }
  }
  const auto summary = run_quietly(folder / "in", folder / "out");
  CHECK_THAT(summary.error, Catch::Contains("tracked 1 of 6 frames") && Catch::Contains("repeated images"));
  CHECK(read_trajectory(folder / "out/trajectory_kitti.txt").poses.size() == 6);
}

TEST_CASE("The frames whose right image does not fit the left one are counted", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 8);
  CHECK(run_quietly(folder / "in", folder / "good").right_image_misfits.empty());
  const auto right = folder / "in" / "image_1" / frame_name(5);
  cv::imwrite(right.string(),
              cv::Mat::zeros(cv::imread(right.string(), cv::IMREAD_GRAYSCALE).size(), CV_8UC1));
  const auto summary = run_quietly(folder / "in", folder / "out");
  CHECK(summary.error.empty());
  CHECK(summary.right_image_misfits == std::vector<std::size_t>{5});
}

TEST_CASE("The memory of a run is recorded for every frame and at its peak", "[runner]") {
  if (std::isnan(resident_memory_mb())) return;
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 4);
  (void)run_quietly(folder / "in", folder / "out");
  for (const auto& line : split_lines(read_text(folder / "out/timing.csv"))) {
    if (line.starts_with("frame")) continue;
    CHECK(std::stod(line.substr(line.rfind(',') + 1)) > 1.0);
  }
  CHECK(peak_resident_memory_mb() >= 0.9 * resident_memory_mb());  // the kernel counts lazily
  CHECK_THAT(read_text(folder / "out/run.yaml"),
             Catch::Contains("peak_mb: ") && Catch::Contains("bytes_per_keyframe: "));
}

TEST_CASE("The CPU time of every frame is recorded, and in run.yaml what a frame costs", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 6);
  const double before_ms = process_cpu_ms();
  const auto summary = run_quietly(folder / "in", folder / "out");
  const double used_ms = process_cpu_ms() - before_ms;
  const auto lines = split_lines(read_text(folder / "out/timing.csv"));
  CHECK_THAT(lines[0], Catch::EndsWith(",total_ms,cpu_ms,read_cpu_ms,rss_mb"));
  double cpu_ms = 0.0;
  double read_cpu_ms = 0.0;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const auto fields = split_fields(lines[i]);
    const double frame_ms = std::stod(std::string(fields[fields.size() - 3]));
    const double read_ms = std::stod(std::string(fields[fields.size() - 2]));
    CHECK(frame_ms > 0.0);
    CHECK(read_ms > 0.0);
    cpu_ms += frame_ms;
    read_cpu_ms += read_ms;
  }
  CHECK(cpu_ms < used_ms);
  CHECK(summary.frame_cost.cpu_ms == Approx(cpu_ms / 6.0).margin(1e-3));
  CHECK(summary.frame_cost.read_cpu_ms == Approx(read_cpu_ms / 6.0).margin(1e-3));
  const auto cost = YAML::LoadFile((folder / "out/run.yaml").string())["frame_cost"];
  CHECK(cost["median_ms"].as<double>() == Approx(summary.frame_cost.median_ms).margin(1e-3));
  CHECK(cost["p95_ms"].as<double>() >= cost["median_ms"].as<double>());
  CHECK(cost["max_ms"].as<double>() >= cost["p95_ms"].as<double>());
  CHECK(cost["cpu_ms"].as<double>() == Approx(cpu_ms / 6.0).margin(1e-3));
}

TEST_CASE("A run that ends before its first frame writes valid files", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  auto sequence = open_sequence(folder / "in", "auto");
  fs::remove(folder / "in/image_0/000000.png");
  RunOptions options{
      .output = folder / "out", .max_frames = std::nullopt, .threads = std::nullopt, .quiet = true};
  options.strict = true;
  const auto summary = run(sequence, Settings{}, options);
  CHECK_FALSE(summary.error.empty());
  check_report(folder / "out", 0);
}

TEST_CASE("The report shows the camera's path, also where the poses of the body are written", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder / "in", 3);
  for (const auto& [camera, was, is] : {std::array{"cam0", "0, 0, 1, 0, 0,", "0, 1, 0, 0, 0,"},
                                        std::array{"cam1", "0.4, 0, 1, 0, 0,", "0, 1, 0, 0, 0.4,"}}) {
    replace_in(fs::path(folder / "in/mav0") / camera / "sensor.yaml", std::string("data: [1, 0, 0, ") + was,
               std::string("data: [0, -1, 0, ") + is);  // a quarter turn about the optical axis
  }
  const auto sequence = open_sequence(folder / "in", "auto");
  const auto path = [&](PoseFrame pose_frame) {
    RunOptions options{.output = folder / "out", .max_frames = 3, .threads = std::nullopt, .quiet = true};
    options.pose_frame = pose_frame;
    options.overwrite = true;
    CHECK(run(sequence, Settings{}, options).error.empty());
    return page_data(read_text(folder / "out/report.html"))["frames"]["position_m"];
  };
  const auto of_camera = path(PoseFrame::kCamera);
  CHECK(of_camera.size() == 9);
  CHECK(path(PoseFrame::kBody) == of_camera);
}

TEST_CASE("A video that ends before its header says ends the run without an error", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_video(folder.path(), 12, 12);
  const auto summary =
      run(open_with_false_header(folder.path(), 14), Settings{},
          {.output = folder / "out", .max_frames = std::nullopt, .threads = 1, .quiet = true});
  CHECK(summary.error.empty());
  CHECK(summary.frames == 12);
}

TEST_CASE("The number of frames can be limited", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 8);
  const auto sequence = open_sequence(folder / "in", "auto");
  RunOptions options{.output = folder / "out", .max_frames = 3, .threads = std::nullopt, .quiet = true};
  CHECK(run(sequence, Settings{}, options).frames == 3);
  check_results(folder / "out", 3);
  options.max_frames = 100;
  options.overwrite = true;
  CHECK(run(sequence, Settings{}, options).frames == 8);
}

TEST_CASE("The results do not depend on the number of threads", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 8);
  (void)run_quietly(folder / "in", folder / "one", 1);
  (void)run_quietly(folder / "in", folder / "two", 2);
  for (const auto* name : {"trajectory_kitti.txt", "trajectory_online.txt", "covariances.csv", "map.ply"}) {
    CAPTURE(name);
    CHECK(read_text(folder / "one" / name) == read_text(folder / "two" / name));
  }
}

TEST_CASE("Real images give the same results with one and two threads", "[runner][data]") {
  const auto data = data_folder();
  if (!data) return;
  const TemporaryFolder folder;
  const auto sequence = open_sequence(*data / "kitti/00_0000-0200", "auto");
  for (const int threads : {1, 2}) {
    (void)run(
        sequence, Settings{},
        {.output = folder / std::to_string(threads), .max_frames = 8, .threads = threads, .quiet = true});
  }
  for (const auto* name : {"trajectory_kitti.txt", "covariances.csv", "map.ply"}) {
    CAPTURE(name);
    CHECK(read_text(folder / "1" / name) == read_text(folder / "2" / name));
  }
}

TEST_CASE("An output folder that cannot be written to is refused before the first frame", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  write_text(folder / "file", "");
  CHECK_THAT(message_of([&] { (void)run_quietly(folder / "in", folder / "file/out"); }),
             Catch::Contains("choose another --output"));
}

TEST_CASE("Debug images are written for every frame and do not change the results", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 4);
  (void)run_quietly(folder / "in", folder / "plain");
  const RunOptions options{.output = folder / "out",
                           .max_frames = std::nullopt,
                           .threads = std::nullopt,
                           .quiet = true,
                           .debug_images = folder / "images"};
  const auto sequence = open_sequence(folder / "in", "auto");
  CHECK(run(sequence, Settings{}, options).error.empty());
  CHECK(std::distance(fs::directory_iterator(folder / "images"), {}) == 4);
  for (int i = 0; i < 4; ++i) {
    CHECK(cv::imread((folder / "images" / ("debug_" + frame_name(i))).string()).cols == TinySequence::kWidth);
  }
  CHECK(read_text(folder / "out/trajectory_kitti.txt") == read_text(folder / "plain/trajectory_kitti.txt"));

  fs::remove(folder / "images/debug_000002.png");
  fs::create_directories(folder / "images/debug_000002.png/x");
  RunOptions again = options;
  again.overwrite = true;
  CHECK_THAT(message_of([&] { (void)run(sequence, Settings{}, again); }),
             Catch::Contains("cannot be used for debug images"));
}
