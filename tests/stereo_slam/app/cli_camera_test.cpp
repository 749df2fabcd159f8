// SPDX-License-Identifier: MIT
// Live cameras, from the command line: a named pipe is the camera.
#include <atomic>
#include <csignal>
#include <cstdint>
#include <fcntl.h>
#include <sys/stat.h>
#include <thread>

#include "stereo_slam/support/program.hpp"
#include "stereo_slam/support/side_by_side.hpp"

using namespace stereo_slam::test;

namespace {

/// Writes the same JPEG into a pipe, fifty times a second, until nobody reads it or it is stopped: the tiny
/// wall, standing still, so that a slow machine, which drops images, can track it too.
class FakeCamera {
 public:
  explicit FakeCamera(const fs::path& pipe) : pipe_(pipe) {
    REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
    std::signal(SIGPIPE, SIG_IGN);
    thread_ = std::jthread([this](const std::stop_token& stop) { write_frames(stop); });
  }

  void stop() {
    thread_.request_stop();
    thread_.join();
  }

 private:
  void write_frames(const std::stop_token& stop) const {
    using Tiny = TinySequence;
    const cv::Mat texture = tiny_texture(Tiny::kWidth + Tiny::kDisparity_px);
    const cv::Rect left(0, 0, Tiny::kWidth, Tiny::kHeight);
    cv::Mat both;
    cv::hconcat(texture(left), texture(left + cv::Point(Tiny::kDisparity_px, 0)), both);
    const int out = open_for_writing(stop);
    while (!stop.stop_requested() && write_all(out, noisy_jpeg(both))) usleep(20'000);
    close(out);
  }

  static std::vector<std::uint8_t> noisy_jpeg(const cv::Mat& image) {
    cv::Mat noise(image.size(), CV_16S);
    cv::randn(noise, 0.0, 1.5);
    cv::Mat noisy;
    cv::add(image, noise, noisy, cv::noArray(), CV_8U);
    std::vector<std::uint8_t> jpeg;
    cv::imencode(".jpg", noisy, jpeg, {cv::IMWRITE_JPEG_QUALITY, 98});
    return jpeg;
  }

  /// Waits for a reader, without getting stuck if there never is one.
  int open_for_writing(const std::stop_token& stop) const {
    int out = -1;
    while (out < 0 && !stop.stop_requested()) {
      out = open(pipe_.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
      if (out < 0) usleep(1000);
    }
    if (out >= 0) fcntl(out, F_SETFL, 0);
    return out;
  }

  static bool write_all(int out, const std::vector<std::uint8_t>& bytes) {
    for (std::size_t done = 0; done < bytes.size();) {
      const auto written = write(out, bytes.data() + done, bytes.size() - done);
      if (written <= 0) return false;
      done += static_cast<std::size_t>(written);
    }
    return true;
  }

  fs::path pipe_;
  std::jthread thread_;
};

std::vector<std::string> run_arguments(const TemporaryFolder& folder) {
  write_text(folder / "calibration.yaml", tiny_calibration(""));
  return {"run",
          "--dataset",
          "file://" + (folder / "camera.mjpeg").string(),
          "--calibration",
          folder / "calibration.yaml",
          "--output",
          folder / "out"};
}

}  // namespace

TEST_CASE("Ctrl-C ends a run with a live camera, with status 0 and all results", "[cli][camera]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "earlier", 2);
  REQUIRE(call({"run", "--dataset", folder / "earlier", "--output", folder / "out"}).status == 0);
  const FakeCamera camera(folder / "camera.mjpeg");
  auto arguments = run_arguments(folder);
  arguments.emplace_back("--overwrite");
  const Program program(folder.path(), arguments);
  program.wait_for_output("  OK");
  program.signal(SIGINT);
  const Result result = program.wait();
  CAPTURE(result.out, result.err);
  CHECK(result.status == 0);
  const auto poses = split_lines(read_text(folder / "out/trajectory_tum.txt"));
  CHECK(poses.size() >= 2);
  CHECK(poses.front().substr(0, 2) >= "16");  // seconds since 1970
  CHECK_THAT(result.out, Catch::Contains("real time: "));
  CHECK_THAT(read_text(folder / "out/run.yaml"),
             Catch::Contains("state: finished") && Catch::Contains("format: camera"));
  CHECK(fs::exists(folder / "out/report.html"));
  CHECK_FALSE(fs::exists(folder / "out/unfinished"));  // a finished run replaces earlier results
}

TEST_CASE("A live camera that ends, or --max-frames, ends the run", "[cli][camera]") {
  const TemporaryFolder folder;
  auto arguments = run_arguments(folder);
  {
    FakeCamera camera(folder / "camera.mjpeg");
    const Program program(folder.path(), arguments);
    program.wait_for_output("  OK");
    camera.stop();
    const Result result = program.wait();
    CAPTURE(result.out, result.err);
    CHECK(result.status == 0);
    CHECK(split_lines(read_text(folder / "out/trajectory_tum.txt")).size() >= 2);
  }
  fs::remove(folder / "camera.mjpeg");
  const FakeCamera camera(folder / "camera.mjpeg");
  arguments.insert(arguments.end(), {"--max-frames", "100", "--overwrite"});
  const Result result = call(arguments);
  CAPTURE(result.out, result.err);
  CHECK(result.status == 0);
  CHECK(split_lines(read_text(folder / "out/trajectory_tum.txt")).size() <= 100);
}

TEST_CASE("info describes a live camera, and one that is not there is one line", "[cli][camera]") {
  const TemporaryFolder folder;
  auto arguments = run_arguments(folder);
  check_one_line_failure(call(arguments), "camera.mjpeg: cannot be opened");
  const FakeCamera camera(folder / "camera.mjpeg");
  const auto info = call({"info", "--dataset", arguments[2], "--calibration", arguments[4]});
  CHECK(info.status == 0);
  CHECK_THAT(info.out, Catch::Contains("format        camera") &&
                           Catch::Contains("frames        without end") &&
                           Catch::Contains("image size    320 x 120"));
}
