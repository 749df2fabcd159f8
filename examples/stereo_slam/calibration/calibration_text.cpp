// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/calibration/calibration_formats.hpp"
#include "stereo_slam/calibration/opencv_xml.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/input_file.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// The name in a line `[NAME]`, in lower case; empty for any other line.
[[nodiscard]] std::string section_name(std::string_view line) {
  const auto text = trimmed(line);
  if (text.size() < 3 || text.front() != '[' || text.back() != ']') return "";
  const std::string name = lower_case(text.substr(1, text.size() - 2));
  const bool is_name = std::ranges::all_of(
      name, [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '/' || c == '-'; });
  return is_name ? name : "";
}

/// The first line that is neither blank nor a comment.
[[nodiscard]] std::string first_line(const fs::path& file) {
  const std::string text = read_file(file, kMostYamlBytes);
  std::string_view rest = text;
  if (rest.starts_with("\xEF\xBB\xBF")) rest.remove_prefix(3);
  while (!rest.empty()) {
    const auto end = rest.find('\n');
    const auto line = trimmed(rest.substr(0, end));
    if (!line.empty() && line.front() != '#' && line.front() != ';') return std::string(line);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  }
  return "";
}

/// The lines of a short file.
[[nodiscard]] std::vector<TextLine> few_lines(const fs::path& file) {
  constexpr std::size_t kMost = 2000;
  auto lines = read_text_lines(file);
  if (lines.size() > kMost) fail(file, "has {} lines, too many for a calibration", lines.size());
  return lines;
}

/// Sections with lines `key = value`, as ZED's files have them; names in lower case.
[[nodiscard]] YAML::Node from_ini(const fs::path& file, const std::vector<TextLine>& lines) {
  YAML::Node root(YAML::NodeType::Map);
  YAML::Node section;
  for (const auto& line : lines) {
    const auto text = trimmed(line.text);
    if (text.empty() || text.front() == ';') continue;
    if (const std::string name = section_name(text); !name.empty()) {
      if (root[name].IsDefined()) fail_at(file, line.number, "the section is there twice");
      section.reset(YAML::Node(YAML::NodeType::Map));  // assignment would change the section before
      root[name] = section;
      continue;
    }
    const auto equals = text.find('=');
    if (equals == std::string_view::npos || !section.IsMap())
      fail_at(file, line.number, "is not a line `key = value` of a section");
    const std::string key = lower_case(trimmed(text.substr(0, equals)));
    if (section[key].IsDefined()) fail_at(file, line.number, key + " is given twice");
    section[key] = std::string(trimmed(text.substr(equals + 1)));
  }
  return root;
}

/// ROS's ost.txt: a name in each line, the numbers in the lines after it. One document per camera, with the
/// keys of camera_calibration's left.yaml.
[[nodiscard]] std::vector<YAML::Node> from_ost(const fs::path& file, const std::vector<TextLine>& lines) {
  constexpr std::pair<std::string_view, const char*> kNames[] = {{"width", "image_width"},
                                                                 {"height", "image_height"},
                                                                 {"camera matrix", "camera_matrix"},
                                                                 {"distortion", "distortion_coefficients"},
                                                                 {"rectification", "rectification_matrix"},
                                                                 {"projection", "projection_matrix"}};
  std::vector<YAML::Node> cameras;
  std::string key;
  for (const auto& line : lines) {
    const auto text = trimmed(line.text);
    if (text.empty()) continue;
    if (const std::string section = section_name(text); !section.empty()) {
      if (section == "image")
        cameras.emplace_back(YAML::NodeType::Map);
      else if (!cameras.empty())
        cameras.back()["camera_name"] = section;
      key.clear();
      continue;
    }
    const auto* const name = std::find_if(std::begin(kNames), std::end(kNames),
                                          [&](const auto& known) { return known.first == text; });
    if (name != std::end(kNames)) {
      key = name->second;
      continue;
    }
    const auto numbers = parse_numbers(text);
    if (!numbers || key.empty() || cameras.empty())
      fail_at(file, line.number, "holds neither numbers nor a name of ost.txt");
    YAML::Node entry = cameras.back()[key];
    const bool single = key.starts_with("image_");
    if (single && (numbers->size() != 1 || entry.IsScalar()))
      fail_at(file, line.number, "expected one number for width and for height");
    for (const double number : *numbers) {
      const std::string value = fmt::format("{:.17g}", number);
      if (single)
        entry = value;
      else
        entry.push_back(value);
    }
  }
  return cameras;
}

/// The document with maps in place of points in the keys: `Camera.fx: 1` becomes `Camera: {fx: 1}`.
[[nodiscard]] YAML::Node nested(const YAML::Node& document) {
  const auto has_point = [](const auto& entry) {
    return entry.first.IsScalar() && entry.first.Scalar().find('.') != std::string::npos;
  };
  if (!document.IsMap() || std::none_of(document.begin(), document.end(), has_point)) return document;
  YAML::Node result(YAML::NodeType::Map);
  for (const auto& entry : document) {
    if (!entry.first.IsScalar()) return document;
    const std::string& key = entry.first.Scalar();
    const auto point = key.find('.');
    if (point == std::string::npos) {
      if (result[key].IsDefined()) return document;
      result[key] = entry.second;
      continue;
    }
    YAML::Node part = result[key.substr(0, point)];
    if (part.IsDefined() && !part.IsNull() && !part.IsMap()) return document;
    part[key.substr(point + 1)] = entry.second;
  }
  return result;
}

}  // namespace

bool CalibrationText::has(std::string_view key) const {
  YAML::Node node = root();
  while (node.IsMap()) {
    const auto point = key.find('.');
    const YAML::Node value = std::as_const(node)[std::string(key.substr(0, point))];
    if (point == std::string_view::npos || !value.IsDefined()) return value.IsDefined();
    node.reset(value);
    key.remove_prefix(point + 1);
  }
  return false;
}

CalibrationText load_calibration_text(const fs::path& file) {
  const std::string first = first_line(file);
  if (first.starts_with('<')) return {file, {load_opencv_xml(file)}};
  if (const auto section = section_name(first); !section.empty()) {
    if (section == "image") return {file, from_ost(file, few_lines(file))};
    return {file, {from_ini(file, few_lines(file))}};
  }
  CalibrationText text{file, {}};
  for (const auto& document : load_yaml_documents(file)) {
    if (!document.IsNull()) text.documents.push_back(nested(document));
  }
  if (text.documents.empty()) text.documents.emplace_back();
  return text;
}

}  // namespace stereo_slam
