// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

namespace stereo_slam {

/// A map of a YAML file, or of another file that was converted to one. Errors name the file, and the line of
/// YAML.
class YamlMap {
 public:
  YamlMap(std::filesystem::path file, const YAML::Node& node, std::string name)
      : file_(std::move(file)), node_(node), name_(std::move(name)) {
    if (!node_.IsMap()) fail(node_, "{} must contain `key: value` lines", name_);
  }

  [[noreturn]] void fail(const YAML::Node& where, const std::string& what) const {
    if (where.IsDefined() && !where.IsNull() && where.Mark().is_null()) stereo_slam::fail(file_, what);
    const int line = where.IsDefined() ? where.Mark().line + 1 : 1;
    throw std::runtime_error(at_line(file_, std::max(line, 1), what));
  }
  [[noreturn]] void fail(const std::string& what) const { fail(node_, what); }
  template <class First, class... Rest>
  [[noreturn]] void fail(const YAML::Node& where, fmt::format_string<First, Rest...> what, First&& first,
                         Rest&&... rest) const {
    fail(where, fmt::format(what, std::forward<First>(first), std::forward<Rest>(rest)...));
  }
  template <class First, class... Rest>
  [[noreturn]] void fail(fmt::format_string<First, Rest...> what, First&& first, Rest&&... rest) const {
    fail(node_, what, std::forward<First>(first), std::forward<Rest>(rest)...);
  }

  [[nodiscard]] bool has(const std::string& key) const { return node_[key].IsDefined(); }
  /// The first key; empty if there is none.
  [[nodiscard]] std::string first_key() const {
    const auto first = node_.begin();
    return first != node_.end() && first->first.IsScalar() ? first->first.Scalar() : "";
  }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] const YAML::Node& node() const { return node_; }

  /// The value of the first of these keys, all of the same meaning, that is present.
  [[nodiscard]] YAML::Node get(std::initializer_list<const char*> keys) const {
    for (const auto* key : keys) {
      if (has(key)) return node_[key];
    }
    fail(fmt::format("{} has no {}; add it", name_, *keys.begin()));
  }

  [[nodiscard]] YamlMap map(const std::string& key) const { return {file_, get({key.c_str()}), key}; }

  [[nodiscard]] std::string text(std::initializer_list<const char*> keys) const {
    const YAML::Node node = get(keys);
    if (!node.IsScalar() || node.Scalar().empty()) fail(node, "{} must be one word", *keys.begin());
    return node.Scalar();
  }

  [[nodiscard]] double number(const char* key) const {
    const YAML::Node node = get({key});
    std::vector<double> values;
    if (node.IsScalar()) append(node, key, values);
    if (values.size() != 1) fail(node, "{} must be one number", key);
    return values.front();
  }

  /// All numbers of a list, nested or not, or of the list `data` of a map, as OpenCV and ROS write matrices.
  [[nodiscard]] std::vector<double> numbers(std::initializer_list<const char*> keys) const {
    const YAML::Node node = get(keys);
    const YAML::Node list = node.IsMap() ? node["data"] : node;
    if (!list.IsDefined() || !list.IsSequence())
      fail(node, "{} must be a list of numbers in [ ]", *keys.begin());
    std::vector<double> values;
    append(list, *keys.begin(), values);
    return values;
  }

  /// The `count` numbers of a matrix, row by row.
  [[nodiscard]] std::vector<double> matrix(const char* key, std::size_t count) const {
    auto values = numbers({key});
    if (values.size() != count)
      fail(get({key}), "{} has {}, but needs {}", key, counted(values.size(), "number"), count);
    return values;
  }

  [[nodiscard]] double number_or(const char* key, double otherwise) const {
    return has(key) ? number(key) : otherwise;
  }

  /// A rigid motion: a matrix of 4x4 numbers row by row, as a list, as four lists, or as `data` of a map.
  [[nodiscard]] Eigen::Isometry3d transform(const char* key) const {
    const YAML::Node node = get({key});
    const YAML::Node data = node.IsMap() ? node["data"] : node;
    if (!data.IsDefined() || !data.IsSequence()) fail(node, "{} needs a 4x4 matrix", key);
    std::vector<double> values;
    append(data, key, values);
    if (values.size() != 16)
      fail(node, "{} has {}, but a 4x4 matrix has 16", key, counted(values.size(), "number"));
    return rigid_motion(node, key, values);
  }

  /// The rigid motion of 16 numbers, row by row; `node` is the value of `key`.
  [[nodiscard]] Eigen::Isometry3d rigid_motion(const YAML::Node& node, const char* key,
                                               const std::vector<double>& values) const {
    using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
    const Eigen::Matrix4d T = Eigen::Map<const RowMajor>(values.data());
    const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
    constexpr double kTolerance = 1e-2;  // admits files with three digits
    const bool rotation =
        (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance &&
        R.determinant() > 0.0;
    if (!rotation || !T.row(3).isApprox(Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0), kTolerance)) {
      fail(node, "{} is not a rigid motion [R t; 0 0 0 1] with a rotation R", key);
    }
    constexpr double kFarthest_m = 1e9;  // larger values are not metres, and computations may overflow
    const double distance_m = T.topRightCorner<3, 1>().cwiseAbs().maxCoeff();
    if (distance_m > kFarthest_m) {
      fail(node, "{} has a translation of {:.3g} m; give it in metres, up to {:.0e}", key, distance_m,
           kFarthest_m);
    }
    return Eigen::Translation3d(T.topRightCorner<3, 1>()) * Eigen::Quaterniond(R).normalized();
  }

  void refuse_unknown_keys(const std::set<std::string>& known) const {
    for (const auto& entry : node_) {
      if (entry.first.IsScalar() && known.contains(entry.first.Scalar())) continue;
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "[...]";
      fail(entry.first, "{} has an unknown key {}{}; known are {}", name_, key, decimals_advice(key),
           fmt::join(known, ", "));
    }
  }

 private:
  void append(const YAML::Node& node, const char* key, std::vector<double>& values) const {
    if (node.IsSequence()) {
      for (const auto& part : node) append(part, key, values);
      return;
    }
    const auto parsed = node.IsScalar() ? parse_numbers(node.Scalar()) : std::nullopt;
    if (!parsed || parsed->size() != 1) {
      fail(node, "{} holds '{}', which is not a finite number", key, node.IsScalar() ? node.Scalar() : "...");
    }
    values.push_back(parsed->front());
  }

  std::filesystem::path file_;
  YAML::Node node_;
  std::string name_;
};

}  // namespace stereo_slam
