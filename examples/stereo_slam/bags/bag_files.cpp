// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/bag_files.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "stereo_slam/bags/unpack.hpp"
#include "stereo_slam/calibration/yaml_map.hpp"
#include "stereo_slam/dataset/euroc.hpp"
#include "stereo_slam/dataset/kitti.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/input_file.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMetadataFile = "metadata.yaml";
constexpr const char* kMetadataKey = "rosbag2_bagfile_information";

/// Whether a folder has rosbag2's metadata of a recording.
[[nodiscard]] bool has_metadata(const fs::path& folder) {
  std::error_code error;
  const fs::path file = folder / kMetadataFile;
  return fs::is_regular_file(file, error) &&
         read_file(file, kMostYamlBytes).find(kMetadataKey) != std::string::npos;
}

/// A file that the metadata of a folder names: there, or where early versions of rosbag2 and packing or
/// unpacking by hand have it.
[[nodiscard]] fs::path named_file(const fs::path& folder, const fs::path& name) {
  const fs::path file = folder / name;
  for (const auto& candidate : {file, folder / name.filename(), fs::path(file.string() + ".zstd"),
                                file.parent_path() / file.stem()}) {
    std::error_code error;  // a name may be too long
    if (fs::is_regular_file(candidate, error)) return candidate;
  }
  fail(folder / kMetadataFile,
       "names {}, which is not there; copy it to the folder, or remove {} to read the files that are there",
       name.string(), kMetadataFile);
}

/// The files that rosbag2's metadata names, in its order.
[[nodiscard]] std::vector<fs::path> files_in_metadata(const fs::path& folder) {
  const fs::path file = folder / kMetadataFile;
  const YamlMap metadata = YamlMap(file, load_yaml_file(file), kMetadataFile).map(kMetadataKey);
  std::string compression;
  if (metadata.has("compression_format")) compression = metadata.get({"compression_format"}).Scalar();
  try {
    (void)compression_of(compression);
  } catch (const std::runtime_error& error) {
    metadata.fail(error.what());
  }
  const YAML::Node names = metadata.get({"relative_file_paths"});
  const auto is_name = [](const YAML::Node& name) { return name.IsScalar() && !name.Scalar().empty(); };
  std::vector<fs::path> files;
  if (!names.IsSequence() || !std::all_of(names.begin(), names.end(), is_name))
    metadata.fail(names, "relative_file_paths must be a list of files");
  for (const auto& name : names) files.push_back(named_file(folder, name.Scalar()));
  if (files.empty()) metadata.fail(names, "relative_file_paths names no file");
  return files;
}

/// The bags in a folder, without hidden files.
[[nodiscard]] std::vector<fs::path> bags_in(const fs::path& folder, std::error_code& error) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const bool hidden = entry.path().filename().string().starts_with('.');
    if (!hidden && has_bag_name(entry.path())) files.push_back(entry.path());
  }
  return files;
}

/// Whether a bag, or what is packed or unpacked from it, is among files.
[[nodiscard]] bool contains(const std::vector<fs::path>& files, const fs::path& bag) {
  return std::ranges::any_of(files, [&](const fs::path& file) {
    return file.filename() == bag.filename() || file.stem() == bag.filename() ||
           file.filename() == bag.stem();
  });
}

/// "A,B" as two names.
[[nodiscard]] std::vector<fs::path> split_names(const std::string& names) {
  std::vector<fs::path> files;
  for (std::size_t begin = 0; begin <= names.size();) {
    const std::size_t end = std::min(names.find(',', begin), names.size());
    files.emplace_back(names.substr(begin, end - begin));
    begin = end + 1;
  }
  return files;
}

}  // namespace

bool has_bag_name(const fs::path& file) {
  const std::string name = lower_case(file.filename().string());
  constexpr std::array<std::string_view, 6> kEnds = {".bag", ".bag.active", ".mcap",
                                                     ".db3", ".mcap.zstd",  ".db3.zstd"};
  return std::ranges::any_of(kEnds, [&](std::string_view end) { return name.ends_with(end); });
}

bool is_bag_recording(const fs::path& recording) {
  std::error_code error;
  if (has_bag_name(recording)) return true;
  if (!fs::is_directory(recording, error) || looks_like_euroc(recording) || looks_like_kitti(recording))
    return false;
  for (const auto* images : {"left", "right"}) {
    if (fs::exists(recording / images, error)) return false;
  }
  return has_metadata(recording) || !bags_in(recording, error).empty();
}

BagFiles bag_files(const fs::path& recording) {
  std::error_code error;
  if (fs::is_directory(recording, error) && !has_bag_name(recording)) {
    BagFiles found{.files = bags_in(recording, error), .are_parts = has_metadata(recording)};
    if (found.are_parts) {
      found.unnamed = std::exchange(found.files, files_in_metadata(recording));
      std::ranges::sort(found.unnamed);
      std::erase_if(found.unnamed, [&](const fs::path& bag) { return contains(found.files, bag); });
      return found;
    }
    if (found.files.empty()) fail(recording, "contains no bags");
    return found;
  }
  const std::string names = recording.string();
  if (fs::exists(recording, error) || names.find(',') == std::string::npos)
    return {.files = {recording}, .are_parts = false};
  return {.files = split_names(names), .are_parts = false};
}

}  // namespace stereo_slam
