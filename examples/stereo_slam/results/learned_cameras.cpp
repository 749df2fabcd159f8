// SPDX-License-Identifier: MIT
#include "stereo_slam/results/learned_cameras.hpp"

#include <set>
#include <stdexcept>
#include <vector>

#include <Eigen/Cholesky>
#include <fmt/ostream.h>
#include <fmt/ranges.h>

#include "stereo_slam/calibration/yaml_map.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/rig/lens_residual.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

namespace stereo_slam {
namespace {

constexpr int kFormat = 1;

/// Mean and covariance of a Gaussian in information form, with all digits.
template <int N>
void write_gaussian(std::ostream& stream, const char* name, const antipode::Matrix<double, N>& information,
                    const antipode::Vector<double, N>& vector) {
  using Matrix = antipode::Matrix<double, N>;
  const Eigen::LDLT<Matrix> factor(information);
  const antipode::Vector<double, N> mean = factor.solve(vector);
  const Matrix covariance = factor.solve(Matrix::Identity());
  fmt::print(stream, "{}:\n  mean_px: [{}]\n  covariance_px2:\n", name,
             fmt::join(mean.data(), mean.data() + N, ", "));
  for (int i = 0; i < N; ++i) {
    const antipode::Vector<double, N> row = covariance.row(i).transpose();
    fmt::print(stream, "    - [{}]\n", fmt::join(row.data(), row.data() + N, ", "));
  }
}

/// Reads what write_gaussian() wrote.
template <int N>
void read_gaussian(const YamlMap& file, const char* name, antipode::Matrix<double, N>& information,
                   antipode::Vector<double, N>& vector) {
  using Matrix = antipode::Matrix<double, N>;
  constexpr auto kCount = static_cast<std::size_t>(N);
  const YamlMap gaussian = file.map(name);
  const auto means = gaussian.matrix("mean_px", kCount);
  const auto values = gaussian.matrix("covariance_px2", kCount * kCount);
  const Matrix covariance = Eigen::Map<const Matrix>(values.data());
  const Eigen::LDLT<Matrix> factor(covariance);
  const bool valid = covariance.isApprox(covariance.transpose(), 1e-6) && factor.info() == Eigen::Success &&
                     factor.isPositive() && factor.vectorD().minCoeff() > 0.0;
  if (!valid)
    gaussian.fail("{} of {} is not a covariance; use the file as `run` wrote it", "covariance_px2", name);
  const Matrix inverse = factor.solve(Matrix::Identity());
  information = 0.5 * (inverse + inverse.transpose());
  vector = information * Eigen::Map<const antipode::Vector<double, N>>(means.data());
}

}  // namespace

void write_learned_cameras(std::ostream& stream, const LearnedCameras& learned) {
  const StereoCamera& c = learned.camera;
  const RectificationEstimate& estimate = learned.estimate;
  const Vector2<double> k = LensResidual(c, estimate.lens).k();
  fmt::print(stream,
             "# What this run learned of its cameras: another one with the same cameras begins with it by\n"
             "# `stereo_slam run --learned cameras.yaml`. docs/datasets.md explains the values.\n"
             "format: {}\n"
             "camera: {{fx: {}, fy: {}, cx: {}, cy: {}, baseline_m: {}, width_px: {}, height_px: {}}}\n"
             "lens_error: {{k1: {:.6f}, k2: {:.6f}}}\n",
             kFormat, c.fx, c.fy, c.cx, c.cy, c.baseline_m, c.width_px, c.height_px, k[0], k[1]);
  if (estimate.delay)
    fmt::print(stream, "right_delay: {{ms: {}, sigma_ms: {}}}\n", 1e3 * estimate.delay->seconds,
               1e3 * estimate.delay->sigma_s);
  write_gaussian<PairGeometry::kTerms>(stream, "row_offset", estimate.row_information, estimate.row_vector);
  write_gaussian<CameraErrors::kTerms>(stream, "disparity_offset_and_lenses", estimate.disparity_information,
                                       estimate.disparity_vector);
}

SavedMap as_map(const LearnedCameras& learned) {
  return {.camera = learned.camera,
          .rectification = learned.estimate,
          .keyframes = {},
          .loops = {},
          .points = {}};
}

void save_learned_cameras(const std::filesystem::path& file, const LearnedCameras& learned) {
  write_file(file, [&](std::ostream& out) { write_learned_cameras(out, learned); });
}

LearnedCameras read_learned_cameras(const std::filesystem::path& path) {
  const YAML::Node node = load_yaml_file(path);
  if (!node.IsMap() || !node["row_offset"].IsDefined() || !node["disparity_offset_and_lenses"].IsDefined()) {
    fail(path, "is not what a run learned of its cameras; give the cameras.yaml of a run's output");
  }
  const YamlMap file(path, node, "the file");
  file.refuse_unknown_keys(
      {"format", "camera", "lens_error", "right_delay", "row_offset", "disparity_offset_and_lenses"});
  if (file.number("format") != kFormat) {
    file.fail("the file has format {}, but this version reads format {}; run the recording again",
              file.text({"format"}), kFormat);
  }
  LearnedCameras learned;
  const YamlMap camera = file.map("camera");
  const auto pixels = [&](const char* key) {
    constexpr double kMost = 1e6;
    const double number = camera.number(key);
    if (!(number >= 1.0 && number <= kMost))
      camera.fail("{} is {}, but an image has 1 to {:.0f} pixels a side", key, number, kMost);
    return static_cast<int>(number);
  };
  learned.camera = {camera.number("fx"), camera.number("fy"),         camera.number("cx"),
                    camera.number("cy"), camera.number("baseline_m"), pixels("width_px"),
                    pixels("height_px")};
  RectificationEstimate& estimate = learned.estimate;
  read_gaussian<PairGeometry::kTerms>(file, "row_offset", estimate.row_information, estimate.row_vector);
  read_gaussian<CameraErrors::kTerms>(file, "disparity_offset_and_lenses", estimate.disparity_information,
                                      estimate.disparity_vector);
  const CameraErrors::Coefficients mean =
      estimate.disparity_information.ldlt().solve(estimate.disparity_vector);
  estimate.coefficients.row(0) = mean.head<PairGeometry::kTerms>().transpose();
  estimate.coefficients.row(1) = estimate.row_information.ldlt().solve(estimate.row_vector).transpose();
  estimate.lens = mean.tail<LensResidual::kTerms>();
  if (node["right_delay"].IsDefined()) {
    const YamlMap delay = file.map("right_delay");
    estimate.delay = {1e-3 * delay.number("ms"), 1e-3 * delay.number("sigma_ms")};
    if (!(estimate.delay->sigma_s > 0.0)) delay.fail("{} is not positive", "sigma_ms");
  }
  try {
    check(as_map(learned));
  } catch (const std::invalid_argument& error) {
    fail(path, error.what());
  }
  return learned;
}

}  // namespace stereo_slam
