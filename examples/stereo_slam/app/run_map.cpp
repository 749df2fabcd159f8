// SPDX-License-Identifier: MIT
#include "stereo_slam/app/run_map.hpp"

#include <stdexcept>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/results/learned_cameras.hpp"
#include "stereo_slam/results/run_folder.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// The SLAM, beginning with what an earlier run learned of the cameras. Errors name the file.
[[nodiscard]] std::unique_ptr<SlamSystem> make_slam_with(const fs::path& learned_file,
                                                         const StereoSequence& sequence,
                                                         const Settings& settings, LoopThread thread) {
  if (settings.system == SystemKind::kPaper || !settings.online_rectification.enabled)
    throw std::runtime_error(
        "--learned needs online rectification: set online_rectification.enabled, and not the preset paper");
  const SavedMap known = as_map(read_learned_cameras(learned_file));
  try {
    return make_slam_system(sequence.camera, settings, thread, known);
  } catch (const std::invalid_argument& error) {
    fail(learned_file, error.what());
  }
}

}  // namespace

void require_keyframes(const Settings& settings) {
  if (settings.loop_closure.enabled && settings.system != SystemKind::kPaper) return;
  throw std::runtime_error(
      settings.system == SystemKind::kPaper
          ? "--save-map and --load-map need keyframes, which the preset paper does not have"
          : "--save-map and --load-map need loop closure; give --loop-closure");
}

std::optional<McapOptions> checked_mcap(const RunOptions& options) {
  if (!options.mcap) return std::nullopt;
  const McapOptions mcap{*options.mcap, options.mcap_images, options.overwrite};
  if (options.debug_images) require_no_folder_of(mcap.file, *options.debug_images);
  check_mcap(mcap, options.output);
  return mcap;
}

void check_save_map(const RunOptions& options) {
  const fs::path& file = *options.save_map;
  std::vector<fs::path> inputs;
  if (options.load_map) inputs.push_back(*options.load_map);
  require_replaceable(file, inputs, [&](std::string_view beginning) {
    if (is_map(beginning) && !options.overwrite) {
      fail(file, "holds an earlier map; name another file, or replace it with --overwrite");
    }
    return is_map(beginning);
  });
  if (options.debug_images) require_no_folder_of(file, *options.debug_images);
  require_writable_besides_results(file, options.output);
  require_other_file(file, options.mcap, "--mcap");
}

std::optional<fs::path> write_map(const RunOptions& options, const SavedMap& map, bool finished,
                                  const EarlierFile& earlier) {
  const fs::path& file = *options.save_map;
  const auto check = [&] {
    check_save_map(options);
    require_unchanged(file, earlier);
  };
  check_or_write_beside(file, "map", check, [&](const fs::path& other) { save_map(other, map); });
  std::error_code absent;
  const bool replaces_map = fs::is_regular_file(file) && fs::file_size(file, absent) > 0;
  if (finished || !replaces_map) {
    save_map(file, map);
    return std::nullopt;
  }
  if (map.keyframes.empty()) return std::nullopt;
  const fs::path other = free_name_beside(file);
  save_map(other, map);
  return other;
}

std::unique_ptr<SlamSystem> make_slam(const StereoSequence& sequence, const Settings& settings,
                                      const RunOptions& options) {
  const auto thread = options.threads == 1 ? LoopThread::kNone : LoopThread::kOwn;
  if (options.learned) return make_slam_with(*options.learned, sequence, settings, thread);
  if (!options.load_map) return make_slam_system(sequence.camera, settings, thread);
  require_keyframes(settings);
  const SavedMap known = load_map(*options.load_map);
  if (known.keyframes.empty()) {
    throw std::runtime_error(
        fmt::format("{}: the map is empty; load a map of a longer run", options.load_map->string()));
  }
  try {
    return make_slam_system(sequence.camera, settings, thread, known,
                            options.save_map ? MapUse::kContinue : MapUse::kLocalise);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", options.load_map->string(), error.what()));
  }
}

}  // namespace stereo_slam
