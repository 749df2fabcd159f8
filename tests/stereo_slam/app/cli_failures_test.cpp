// SPDX-License-Identifier: MIT
#include "stereo_slam/support/program.hpp"

using namespace stereo_slam::test;

TEST_CASE("--loop-closure is refused before the run if no loop can be closed", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  write_text(folder / "paper.yaml", "preset: paper\n");
  const auto run = [&](const std::vector<std::string>& options) {
    return run_on(folder / "in", folder, options);
  };
  for (const auto& options : std::vector<std::vector<std::string>>{
           {"--preset", "paper", "--loop-closure"}, {"--config", folder / "paper.yaml", "--loop-closure"}}) {
    check_one_line_failure(run(options),
                           "the preset paper has one map without keyframes, and closes no loops");
    CHECK_FALSE(fs::exists(folder / "out"));
  }
  CHECK(run({"--preset", "paper", "--no-loop-closure"}).status == 0);
}

TEST_CASE("A folder that cannot take debug images gives one line and status 1", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  write_text(folder / "file", "");
  check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "out",
                               "--debug-images", folder / "file"}),
                         "choose another folder");
}

TEST_CASE("Broken input gives one line and status 1, from run and from info", "[cli]") {
  const auto rename_images = [](const fs::path& f) {
    fs::rename(f / "image_0", f / "x");
    fs::rename(f / "image_1", f / "image_0");
    fs::rename(f / "x", f / "image_1");
  };
  const std::vector<Breaking> cases = {
      {"no such folder", [](const fs::path& f) { fs::remove_all(f); }},
      {"calib.txt: missing", [](const fs::path& f) { fs::remove(f / "calib.txt"); }},
      {"baseline of zero",
       [](const fs::path& f) {
         write_text(f / "calib.txt", projection_line("P0", 0) + projection_line("P1", 0));
       }},
      {"look swapped", rename_images},
      {"image_1/000002.png: missing", [](const fs::path& f) { fs::remove(f / "image_1/000002.png"); }},
      {"image_0/000002.png: the PNG is truncated",
       [](const fs::path& f) { truncate_file(f / "image_0/000002.png", 0.6); }},
      {"000003.png: is 200x120",
       [](const fs::path& f) { cv::imwrite((f / "image_0/000003.png").string(), tiny_texture(200)); }},
      {"times.txt:3: 'noon' is not",
       [](const fs::path& f) { write_text(f / "times.txt", "0\n1\nnoon\n3\n4\n"); }},
      {"has 3 times for 5 images", [](const fs::path& f) { write_text(f / "times.txt", "0\n1\n2\n"); }},
      {"is empty",
       [](const fs::path& f) { fs::remove_all(f / "image_0"), fs::create_directory(f / "image_0"); }},
      {"single frame", [](const fs::path& f) { fs::remove_all(f), write_tiny_sequence(f, 1); }},
  };
  check_refused(write_tiny_sequence, cases);
}

TEST_CASE("With --strict a run fails at an image that cannot be read, and saves the frames before it",
          "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 5);
  truncate_file(folder / "in/image_1/000003.png", 0.5);
  const std::vector<std::string> run = {"run",      "--dataset",    folder / "in",
                                        "--output", folder / "out", "--strict"};
  check_one_line_failure(call(run), "(the 3 frames before it are saved)");
  CHECK(split_lines(read_text(folder / "out/trajectory_kitti.txt")).size() == 3);
}

TEST_CASE("Without --strict a warning counts the images that cannot be read, and names the first", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 8);
  truncate_file(folder / "in/image_1/000003.png", 0.5);
  write_text(folder / "in/image_0/000005.png", "");
  const std::vector<std::string> arguments = {"run",          "--dataset", folder / "in",      "--output",
                                              folder / "out", "--json",    folder / "run.json"};
  const auto run = call(arguments);
  CHECK(run.status == 0);
  CHECK_THAT(run.err,
             Catch::Contains("warning: 2 of the images of 8 frames could not be read, and were treated as "
                             "missing (run.yaml names them); the first: ") &&
                 Catch::Contains("image_1/000003.png: the PNG is truncated"));
  CHECK_THAT(read_text(folder / "out/run.yaml"),
             Catch::Contains("count: 2") && Catch::Contains("image_0/000005.png: the file is empty"));
  CHECK_THAT(run.out, Catch::Contains("1 of 8 frames WEAK: right image missing or in doubt (1)\n"));
  CHECK_THAT(read_text(folder / "run.json"), Catch::Contains("\"right_image_unfit\": 1"));
  CHECK_THAT(read_text(folder / "run.json"),
             Catch::Contains("\"frame\": 3") && Catch::Contains("image_0/000005.png: the file is empty"));
  CHECK(split_lines(read_text(folder / "out/trajectory_kitti.txt")).size() == 8);
}

TEST_CASE("A run without a readable image but the first says that this is why nothing was tracked", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 5);
  for (int i = 1; i < 5; ++i) truncate_file(folder / "in/image_0" / frame_name(i), 0.5);
  check_one_line_failure(call({"run", "--quiet", "--dataset", folder / "in", "--output", folder / "out"}),
                         "because 4 images could not be read; the first: ");
}

TEST_CASE("Every other failure gives one line and status 1", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  write_text(folder / "bad.yaml", "features: {count: 1}\n");
  write_text(folder / "file", "");
  const std::string in = folder / "in";
  check_one_line_failure(
      call({"run", "--dataset", in, "--output", folder / "o", "--config", folder / "bad.yaml"}),
      "features.count");
  check_one_line_failure(
      call({"run", "--dataset", in, "--output", folder / "o", "--config", folder / "no.yaml"}), "no.yaml");
  check_one_line_failure(call({"run", "--dataset", in, "--output", folder / "file"}), "--output");
  check_one_line_failure(call({"run", "--dataset", in, "--output", folder / "o", "--format", "euroc"}),
                         "has no cam0 and cam1");
  check_one_line_failure(call({"run", "--dataset", in, "--output", folder / "o", "--pose-frame", "body"}),
                         "leave out --pose-frame body");
  check_one_line_failure(call({"info", "--dataset", in, "--write-groundtruth", folder / "no/such/place.txt"}),
                         "place.txt");
  check_one_line_failure(
      call({"evaluate", "--groundtruth", in + "/poses.txt", "--estimate", in + "/none.txt"}), "none.txt");
  check_one_line_failure(call({"simulate", "--output", folder / "s", "--trajectory", in + "/none.txt"}),
                         "none.txt");
}

TEST_CASE("--view without a display gives one line and status 1", "[cli]") {
  if (std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr) return;
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "o", "--view"}),
                         "--view");
}
