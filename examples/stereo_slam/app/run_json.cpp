// SPDX-License-Identifier: MIT
#include "stereo_slam/app/run_json.hpp"

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/results/run_folder.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::string_view kBeginning = "{\n  \"stereo_slam\": \"";

/// The number, or null for NaN and infinity, which JSON does not have.
[[nodiscard]] Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

[[nodiscard]] Json frame_times(const FrameCost& cost) {
  return {{"median_ms", number(cost.median_ms)},
          {"p95_ms", number(cost.p95_ms)},
          {"max_ms", number(cost.max_ms)},
          {"cpu_ms", number(cost.cpu_ms)}};
}

[[nodiscard]] Json as_json(const DelayEstimate& delay) {
  return {{"ms", number(1e3 * delay.seconds)}, {"sigma_ms", number(1e3 * delay.sigma_s)}};
}

/// The reasons that frames have, by their names.
[[nodiscard]] Json reason_counts(const ReasonCounts& counts) {
  Json json = Json::object();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) json[kWeakReasons[i].name] = counts[i];
  }
  return json;
}

/// Velocity, gravity and biases, in the axes of the IMU, each as its three numbers and their standard
/// deviations, and the delay.
[[nodiscard]] Json inertial_estimate(const InertialEstimate& estimate) {
  Json json = Json::object();
  const auto add = [&](const std::string& name, const Vector3<double>& value, int begin) {
    const Vector3<double> variances = estimate.covariance.diagonal().segment<3>(begin);
    for (int i = 0; i < 3; ++i) {
      json[name].push_back(number(value[i]));
      json[name + "_sigma"].push_back(number(std::sqrt(std::max(variances[i], 0.0))));
    }
  };
  add("velocity_m_s", estimate.velocity, 0);
  add("gravity_m_s2", estimate.gravity, 3);
  add("gyroscope_bias_rad_s", estimate.biases.head<3>(), 6);
  add("accelerometer_bias_m_s2", estimate.biases.tail<3>(), 9);
  json["delay_s"] = number(estimate.delay_s);
  json["delay_s_sigma"] = number(std::sqrt(std::max(estimate.covariance(12, 12), 0.0)));
  return json;
}

void write_json(std::ostream& stream, const RunSummary& summary, const StereoSequence& sequence,
                const Settings& settings) {
  Json json;
  json["stereo_slam"] = STEREO_SLAM_VERSION;
  json["state"] = !summary.error.empty() ? "failed" : summary.interrupted ? "interrupted" : "finished";
  json["error"] = summary.error;
  json["dataset"] = full_name(sequence);
  json["format"] = sequence.format;
  json["preset"] = settings.preset;
  json["output"] = fs::absolute(summary.folder).string();
  json["frames"] = summary.frames;
  json["frames_lost"] = summary.lost;
  json["frames_by_status"] = summary.frames_by_status;
  json["weak_frames_by_reason"] = reason_counts(summary.weak_frames_by_reason);
  json["unreadable_images"] = Json::array();
  for (const auto& image : summary.unreadable)
    json["unreadable_images"].push_back({{"frame", image.frame}, {"fault", image.fault}});
  json["right_image_misfits"] = summary.right_image_misfits;
  json["right_image_displacement_px"] = number(summary.rig.right_image_displacement_px);
  if (const auto& lens = summary.rig.lens_error) {
    json["lens_error"] = {{"k1", number(lens->k[0])},
                          {"k2", number(lens->k[1])},
                          {"k1_sigma", number(lens->sigma[0])},
                          {"k2_sigma", number(lens->sigma[1])}};
  }
  if (const auto& delay = summary.rig.right_delay) json["right_delay"] = as_json(*delay);
  if (const auto& imu = summary.inertial) {
    json["imu"] = {{"phase", to_string(imu->phase)}, {"starts", imu->starts}, {"restarts", imu->restarts}};
    json["imu"]["nis"] = number(imu->nis);
    json["imu"]["delay_ms"] = number(1e3 * imu->delay_s);
    json["imu"]["delay_sigma_ms"] = number(1e3 * imu->delay_sigma_s);
    for (int i = 0; i < 3; ++i) {
      json["imu"]["turn_rad"].push_back(number(imu->turn_rad[i]));
      json["imu"]["turn_sigma_rad"].push_back(number(imu->turn_sigma_rad[i]));
      json["imu"]["offset_m"].push_back(number(imu->offset_m[i]));
      json["imu"]["offset_sigma_m"].push_back(number(imu->offset_sigma_m[i]));
    }
    if (!imu->fault.empty()) json["imu"]["fault"] = imu->fault;
    if (summary.last_inertial) json["imu"]["last"] = inertial_estimate(*summary.last_inertial);
  }
  if (summary.rig.refused_learned) json["refused_learned"] = true;
  json["right_camera_turns"] = summary.right_camera_turns;
  json["keyframes"] = summary.keyframes;
  json["landmarks"] = summary.landmarks;
  json["loops_accepted"] = summary.loops_accepted;
  json["loops_refused"] = summary.loops_refused;
  json["path_m"] = number(summary.path_m);
  json["last_sigma_m"] = number(summary.last_sigma_m);
  json["last_sigma_deg"] = number(summary.last_sigma_deg);
  json["seconds"] = number(summary.seconds);
  json["frames_per_second"] = number(static_cast<double>(summary.frames) / std::max(summary.seconds, 1e-9));
  json["frame"] = frame_times(summary.frame_cost);
  json["peak_memory_mb"] = number(summary.peak_mb);
  if (summary.realtime) {
    json["realtime"] = {{"dropped", summary.realtime->dropped},
                        {"latency_median_ms", number(summary.realtime->median_ms)},
                        {"latency_p95_ms", number(summary.realtime->p95_ms)},
                        {"latency_max_ms", number(summary.realtime->max_ms)}};
  }
  // File names may contain bytes that are not UTF-8; these are replaced.
  stream << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

}  // namespace

RunJson::RunJson(fs::path file, std::vector<fs::path> inputs, const RunOptions& options)
    : file_(std::move(file)), inputs_(std::move(inputs)), options_(options) {
  check();
  earlier_ = earlier_file(file_);
}

void RunJson::check() const {
  require_replaceable(file_, inputs_,
                      [](std::string_view beginning) { return beginning.starts_with(kBeginning); });
  if (options_.debug_images) require_no_folder_of(file_, *options_.debug_images);
  require_writable_besides_results(file_, options_.output);
  require_other_file(file_, options_.save_map, "--save-map");
  require_other_file(file_, options_.mcap, "--mcap");
}

void RunJson::write(const RunSummary& summary, const StereoSequence& sequence,
                    const Settings& settings) const {
  const auto write_to = [&](const fs::path& file) {
    write_file(file, [&](std::ostream& out) { write_json(out, summary, sequence, settings); });
  };
  const auto check_again = [&] {
    check();
    require_unchanged(file_, earlier_);
  };
  check_or_write_beside(file_, "JSON object", check_again, write_to);
  write_to(file_);
}

}  // namespace stereo_slam
