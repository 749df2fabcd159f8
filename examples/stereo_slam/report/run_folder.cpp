// SPDX-License-Identifier: MIT
#include "stereo_slam/report/run_folder.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>

#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/report/rounding.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

namespace stereo_slam::report {
namespace {

namespace fs = std::filesystem;

/// The columns of a file with a header, as text.
using Table = std::map<std::string, std::vector<std::string>, std::less<>>;

/// Fields between commas; they may be empty.
[[nodiscard]] std::vector<std::string> split_at_commas(std::string_view text) {
  std::vector<std::string> fields;
  for (;;) {
    const auto comma = text.find(',');
    fields.emplace_back(text.substr(0, comma));
    if (comma == std::string_view::npos) return fields;
    text.remove_prefix(comma + 1);
  }
}

[[nodiscard]] Table read_table(const fs::path& file) {
  const auto lines = read_text_lines(file);
  if (lines.empty()) throw std::runtime_error(fmt::format("{}: is empty", file.string()));
  const auto names = split_at_commas(lines.front().text);
  Table table;
  for (const auto& name : names) table[name];
  for (std::size_t i = 1; i < lines.size(); ++i) {
    auto fields = split_at_commas(lines[i].text);
    if (fields.size() != names.size()) {
      throw std::runtime_error(at_line(
          file, lines[i].number, fmt::format("has {} fields, the header {}", fields.size(), names.size())));
    }
    for (std::size_t c = 0; c < names.size(); ++c) table[names[c]].push_back(std::move(fields[c]));
  }
  return table;
}

/// Throws std::runtime_error unless a table has one row for each pose. Otherwise the files are of different
/// runs, or one was cut off.
void require_rows(const fs::path& file, const Table& table, std::size_t poses) {
  const std::size_t rows = table.begin()->second.size();
  if (rows == poses) return;
  throw std::runtime_error(
      fmt::format("{}: has {} rows for {} poses in trajectory_tum.txt; copy the folder of the run again",
                  file.string(), rows, poses));
}

[[nodiscard]] double to_number(const std::string& text) {
  const auto numbers = parse_numbers(text);
  return numbers && numbers->size() == 1 ? numbers->front() : kNaN;
}

/// A column as `count` numbers; all NaN if there is no such column.
[[nodiscard]] std::vector<double> column(const Table& table, std::string_view name, std::size_t count) {
  std::vector<double> values;
  if (const auto found = table.find(name); found != table.end()) {
    for (const auto& text : found->second) values.push_back(to_number(text));
  }
  values.resize(count, kNaN);
  return values;
}

/// Collects the scalars below a node with the path of their keys.
void collect(const YAML::Node& node, const std::string& path, std::map<std::string, std::string>& entries) {
  if (node.IsScalar()) entries[path] = node.Scalar();
  if (!node.IsMap()) return;
  for (const auto& entry : node)
    collect(entry.second, path.empty() ? entry.first.Scalar() : path + "." + entry.first.Scalar(), entries);
}

[[nodiscard]] std::map<std::string, std::string> read_run_yaml(const fs::path& file) {
  if (!fs::is_regular_file(file)) {
    throw std::runtime_error(
        fmt::format("{}: not found; give the --output folders of `stereo_slam run`", file.string()));
  }
  std::map<std::string, std::string> entries;
  collect(load_yaml_file(file), "", entries);
  return entries;
}

void add_covariances(const Table& table, RunFolder& run) {
  const std::size_t count = run.trajectory.poses.size();
  const auto x = column(table, "tx_tx_m2", count), y = column(table, "ty_ty_m2", count),
             z = column(table, "tz_tz_m2", count);
  const auto nis = column(table, "nis", count), dof = column(table, "nis_dof", count);
  for (std::size_t k = 0; k < count; ++k) {
    run.sigma_m.push_back(std::sqrt(x[k] + y[k] + z[k]));
    run.nis_per_dof.push_back(dof[k] > 0.0 ? nis[k] / dof[k] : kNaN);
  }
  const auto status = table.find("status");
  if (status == table.end()) return;
  run.lost = static_cast<std::size_t>(std::count(status->second.begin(), status->second.end(), "LOST"));
}

}  // namespace

std::string RunFolder::entry(const std::string& key) const {
  const auto found = entries.find(key);
  return found == entries.end() ? "" : found->second;
}

double RunFolder::number(const std::string& key) const { return to_number(entry(key)); }

RunFolder read_run_folder(const fs::path& folder) {
  RunFolder run;
  run.folder = folder;
  run.entries = read_run_yaml(folder / "run.yaml");
  run.problem = run.entry("error");
  for (const auto* name : {"trajectory_tum.txt", "covariances.csv", "timing.csv", "loops.csv"}) {
    if (fs::is_regular_file(folder / name)) continue;
    if (run.problem.empty()) run.problem = fmt::format("has no {}; the run has not ended", name);
    return run;
  }
  if (fs::file_size(folder / "trajectory_tum.txt") == 0) return run;
  run.trajectory = read_trajectory(folder / "trajectory_tum.txt", TrajectoryFormat::kTum);
  const std::size_t count = run.trajectory.poses.size();
  const Table covariances = read_table(folder / "covariances.csv");
  require_rows(folder / "covariances.csv", covariances, count);
  add_covariances(covariances, run);
  const Table timing = read_table(folder / "timing.csv");
  require_rows(folder / "timing.csv", timing, count);
  run.total_ms = column(timing, "total_ms", count);
  run.resident_mb = column(timing, "rss_mb", count);
  const Table loops = read_table(folder / "loops.csv");
  if (const auto verdict = loops.find("verdict"); verdict != loops.end()) {
    run.accepted_loops =
        static_cast<std::size_t>(std::count(verdict->second.begin(), verdict->second.end(), "accepted"));
  }
  return run;
}

}  // namespace stereo_slam::report
