// SPDX-License-Identifier: MIT
#include "stereo_slam/results/run_yaml.hpp"

#include <cmath>
#include <ctime>
#include <fstream>
#include <ios>
#include <iterator>
#include <numbers>
#include <stdexcept>
#include <string>
#include <string_view>
#include <sys/utsname.h>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/settings/settings_io.hpp"

namespace stereo_slam {
namespace {

std::string processor_name() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

template <class Value>
void emit(YAML::Emitter& yaml, const char* key, const Value& value) {
  yaml << YAML::Key << key << YAML::Value << value;
}

void emit_map(YAML::Emitter& yaml, const char* key) {
  yaml << YAML::Key << key << YAML::Value << YAML::BeginMap;
}

void emit_host(YAML::Emitter& yaml) {
  utsname system{};
  uname(&system);
  emit_map(yaml, "host");
  emit(yaml, "name", system.nodename);
  emit(yaml, "system", fmt::format("{} {} {}", system.sysname, system.release, system.machine));
  emit(yaml, "processor", processor_name());
  emit(yaml, "cores", std::thread::hardware_concurrency());
  emit(yaml, "compiler", __VERSION__);
  emit(yaml, "opencv", CV_VERSION);
  yaml << YAML::EndMap;
}

void emit_dataset(YAML::Emitter& yaml, const StereoSequence& sequence) {
  emit_map(yaml, "dataset");
  // Quoted strings are always UTF-8: bytes of the name that are not are replaced.
  yaml << YAML::Key << "folder" << YAML::Value << YAML::DoubleQuoted << full_name(sequence);
  emit(yaml, "format", sequence.format);
  yaml << YAML::Key << "image_size" << YAML::Value << YAML::Flow << YAML::BeginSeq << sequence.camera.width_px
       << sequence.camera.height_px << YAML::EndSeq;
  if (!sequence.unscaled.empty()) {
    yaml << YAML::Key << "scaled_from" << YAML::Value << YAML::Flow << YAML::BeginSeq
         << sequence.unscaled.width << sequence.unscaled.height << YAML::EndSeq;
  }
  if (!sequence.live) emit(yaml, "frames", sequence.frames.size());
  yaml << YAML::EndMap;
}

void emit_frame_cost(YAML::Emitter& yaml, const FrameCost& cost) {
  emit_map(yaml, "frame_cost");
  for (const auto& [name, ms] : {std::pair{"median_ms", cost.median_ms}, std::pair{"p95_ms", cost.p95_ms},
                                 std::pair{"max_ms", cost.max_ms}, std::pair{"cpu_ms", cost.cpu_ms},
                                 std::pair{"read_cpu_ms", cost.read_cpu_ms}}) {
    emit(yaml, name, fmt::format("{:.3f}", ms));
  }
  yaml << YAML::EndMap;
}

void emit_realtime(YAML::Emitter& yaml, const RealtimeSummary& summary) {
  emit_map(yaml, "realtime");
  emit(yaml, "frames_dropped", summary.dropped);
  for (const auto& [name, value] :
       {std::pair{"latency_median_ms", summary.median_ms}, std::pair{"latency_p95_ms", summary.p95_ms},
        std::pair{"latency_max_ms", summary.max_ms}, std::pair{"reading_delay_s", summary.reading_delay_s}}) {
    emit(yaml, name, fmt::format("{:.3f}", value));
  }
  yaml << YAML::EndMap;
}

void emit_memory(YAML::Emitter& yaml, const RunHeader& header) {
  emit_map(yaml, "memory");
  if (!std::isnan(header.peak_mb)) emit(yaml, "peak_mb", fmt::format("{:.1f}", header.peak_mb));
  if (header.bytes_per_keyframe > 0) emit(yaml, "bytes_per_keyframe", header.bytes_per_keyframe);
  yaml << YAML::EndMap;
}

void emit_reasons(YAML::Emitter& yaml, const ReasonCounts& counts) {
  yaml << YAML::Key << "weak_frames_by_reason" << YAML::Value << YAML::Flow << YAML::BeginMap;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) emit(yaml, kWeakReasons[i].name, counts[i]);
  }
  yaml << YAML::EndMap;
}

void emit_lens_error(YAML::Emitter& yaml, const LensEstimate& lens) {
  yaml << YAML::Key << "lens_error" << YAML::Value << YAML::Flow << YAML::BeginMap;
  emit(yaml, "k1", fmt::format("{:.6f}", lens.k[0]));
  emit(yaml, "k2", fmt::format("{:.6f}", lens.k[1]));
  emit(yaml, "k1_sigma", fmt::format("{:.6f}", lens.sigma[0]));
  emit(yaml, "k2_sigma", fmt::format("{:.6f}", lens.sigma[1]));
  yaml << YAML::EndMap;
}

void emit_right_delay(YAML::Emitter& yaml, const DelayEstimate& delay) {
  yaml << YAML::Key << "right_delay" << YAML::Value << YAML::Flow << YAML::BeginMap;
  emit(yaml, "ms", fmt::format("{:.3f}", 1e3 * delay.seconds));
  emit(yaml, "sigma_ms", fmt::format("{:.3f}", 1e3 * delay.sigma_s));
  yaml << YAML::EndMap;
}

void emit_inertial(YAML::Emitter& yaml, const InertialSummary& inertial) {
  emit_map(yaml, "imu");
  emit(yaml, "phase", to_string(inertial.phase));
  emit(yaml, "starts", inertial.starts);
  emit(yaml, "restarts", inertial.restarts);
  emit(yaml, "nis", fmt::format("{:.2f}", inertial.nis));
  emit(yaml, "delay_ms", fmt::format("{:.2f}", 1e3 * inertial.delay_s));
  emit(yaml, "delay_sigma_ms", fmt::format("{:.2f}", 1e3 * inertial.delay_sigma_s));
  const antipode::Vector3<double> turn_deg = 180.0 / std::numbers::pi * inertial.turn_rad;
  emit(yaml, "turn_deg", fmt::format("{:.2f}, {:.2f}, {:.2f}", turn_deg.x(), turn_deg.y(), turn_deg.z()));
  const antipode::Vector3<double> offset_mm = 1e3 * inertial.offset_m;
  emit(yaml, "offset_mm", fmt::format("{:.1f}, {:.1f}, {:.1f}", offset_mm.x(), offset_mm.y(), offset_mm.z()));
  if (!inertial.fault.empty())
    yaml << YAML::Key << "fault" << YAML::Value << YAML::DoubleQuoted << inertial.fault;
  yaml << YAML::EndMap;
}

/// Names the first hundred; run.yaml is read again as settings, and so has to stay small.
void emit_unreadable(YAML::Emitter& yaml, const std::vector<UnreadableImage>& unreadable) {
  constexpr std::size_t kNamed = 100;
  emit_map(yaml, "unreadable_images");
  emit(yaml, "count", unreadable.size());
  if (!unreadable.empty()) {
    yaml << YAML::Key << "first" << YAML::Value << YAML::BeginSeq;
    for (std::size_t i = 0; i < std::min(kNamed, unreadable.size()); ++i)
      yaml << YAML::DoubleQuoted << unreadable[i].fault;
    yaml << YAML::EndSeq;
  }
  yaml << YAML::EndMap;
}

/// Changes the state in a run.yaml from running to failed, in place, which needs no room on the disk.
void mark_failed(const std::filesystem::path& run_yaml) {
  constexpr std::string_view kRunning = "\nstate: running";
  constexpr std::string_view kFailed = "\nstate: failed ";
  static_assert(kRunning.size() == kFailed.size());
  std::fstream file(run_yaml, std::ios::in | std::ios::out | std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto at = text.find(kRunning);
  if (at == text.npos) return;
  file.clear();
  file.seekp(static_cast<std::streamoff>(at));
  file << kFailed;
}

}  // namespace

void write_run_yaml(const std::filesystem::path& folder, const RunHeader& header,
                    const StereoSequence& sequence, const Settings& settings) {
  YAML::Emitter yaml;
  yaml << YAML::BeginMap;
  emit(yaml, "version", STEREO_SLAM_VERSION);
  emit(yaml, "written", fmt::format("{:%FT%TZ}", fmt::gmtime(std::time(nullptr))));
  emit(yaml, "state", header.state);
  if (!header.error.empty()) emit(yaml, "error", header.error);
  emit(yaml, "frames_processed", header.frames_processed);
  emit(yaml, "seconds", fmt::format("{:.3f}", header.seconds));
  emit(yaml, "pose_frame", header.pose_frame);
  emit_frame_cost(yaml, header.frame_cost);
  if (header.realtime) emit_realtime(yaml, *header.realtime);
  emit_memory(yaml, header);
  if (header.state != "running") emit_reasons(yaml, header.weak_frames_by_reason);
  if (header.rig.lens_error) emit_lens_error(yaml, *header.rig.lens_error);
  if (header.rig.right_delay) emit_right_delay(yaml, *header.rig.right_delay);
  if (header.inertial) emit_inertial(yaml, *header.inertial);
  emit_unreadable(yaml, header.unreadable);
  emit_dataset(yaml, sequence);
  emit_host(yaml);
  yaml << YAML::EndMap;
  try {
    write_file(folder / "run.yaml", [&](std::ostream& out) {
      out << yaml.c_str() << "\nsettings:\n";
      write_settings(out, settings, 2);
    });
  } catch (const std::runtime_error&) {
    mark_failed(folder / "run.yaml");
    throw;
  }
}

}  // namespace stereo_slam
