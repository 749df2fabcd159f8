// SPDX-License-Identifier: MIT
#include "stereo_slam/calibration/opencv_xml.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/input_file.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

namespace stereo_slam {
namespace {

constexpr std::string_view kSpaces = " \t\r\n";

/// The values of an element without children.
YAML::Node values_in(std::string text) {
  std::ranges::replace(text, '\n', ' ');
  YAML::Node values;
  const auto fields = split_fields(text);
  for (auto field : fields) {
    const bool quoted = field.size() > 1 && field.front() == '"' && field.back() == '"';
    values.push_back(std::string(quoted ? field.substr(1, field.size() - 2) : field));
  }
  return fields.size() == 1 ? YAML::Node(values[0].Scalar()) : values;
}

/// The children of an element.
class Children {
 public:
  /// False if there are too many, two with one name, or both named ones and list entries.
  [[nodiscard]] bool add(const std::string& name, const YAML::Node& child) {
    constexpr std::size_t kMost = 1000;
    const bool is_entry = name == "_";
    if (++count_ > kMost || (count_ > 1 && is_entry != is_list_)) return false;
    is_list_ = is_entry;
    if (is_entry) {
      node_.push_back(child);
      return true;
    }
    if (node_[name].IsDefined()) return false;
    node_[name] = child;
    return true;
  }

  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] const YAML::Node& node() const { return node_; }

 private:
  YAML::Node node_;
  std::size_t count_ = 0;
  bool is_list_ = false;
};

class XmlReader {
 public:
  explicit XmlReader(std::string_view text) : rest_(text) {}

  /// Skips to the end of the start tag of the file's element. False if there is none.
  [[nodiscard]] bool find_storage() {
    const auto begin = rest_.find("<opencv_storage");
    if (begin == std::string_view::npos) return false;
    rest_.remove_prefix(begin);
    return take_until(">").has_value();
  }

  /// What the element `name` contains, to the end of its end tag. Nothing if it is damaged or too deep.
  [[nodiscard]] std::optional<YAML::Node> content(std::string_view name, int depth) {
    constexpr int kDeepest = 16;
    if (depth > kDeepest) return std::nullopt;
    std::string text;
    Children children;
    while (const auto before = take_until("<")) {
      text += *before;
      if (rest_.starts_with("!--")) {
        if (!take_until("-->")) return std::nullopt;
        continue;
      }
      const auto tag = take_until(">");
      if (!tag) return std::nullopt;
      if (tag->starts_with('/')) {
        if (name_in(tag->substr(1)) != name) return std::nullopt;
        return children.empty() ? values_in(std::move(text)) : children.node();
      }
      const auto child_name = name_in(*tag);
      const auto child = tag->ends_with('/') ? YAML::Node() : content(child_name, depth + 1);
      if (child_name.empty() || !child || !children.add(std::string(child_name), *child)) return std::nullopt;
    }
    return std::nullopt;
  }

 private:
  /// The text before `end`, which is removed together with it; nothing if it does not occur.
  std::optional<std::string_view> take_until(std::string_view end) {
    const auto at = rest_.find(end);
    if (at == std::string_view::npos) return std::nullopt;
    const auto taken = rest_.substr(0, at);
    rest_.remove_prefix(at + end.size());
    return taken;
  }

  /// The name in a tag, without attributes.
  [[nodiscard]] static std::string_view name_in(std::string_view tag) {
    return tag.substr(0, std::min(tag.find_first_of(kSpaces), tag.find('/')));
  }

  std::string_view rest_;
};

}  // namespace

YAML::Node load_opencv_xml(const std::filesystem::path& file) {
  const std::string text = read_file(file, kMostYamlBytes);
  XmlReader reader(text);
  if (reader.find_storage()) {
    const auto content = reader.content("opencv_storage", 0);
    if (content && content->IsMap()) return *content;
  }
  fail(file, "is no XML file of named values that OpenCV wrote, or is damaged; write it by cv::FileStorage");
}

}  // namespace stereo_slam
