// SPDX-License-Identifier: MIT
#include "stereo_slam/report/run_folder.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string_view>

#include <fmt/format.h>

#include "stereo_slam/evaluation/nees.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/covariance_columns.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/table_row.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/report/rounding.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

namespace stereo_slam::report {
namespace {

namespace fs = std::filesystem;

/// The columns of a file with a header, as text.
using Table = std::map<std::string, std::vector<std::string>, std::less<>>;

[[nodiscard]] Table table_of(const fs::path& file, const std::vector<TextLine>& lines) {
  if (lines.empty()) fail(file, "is empty");
  require_line_end(file, lines);
  const auto names = split_row(lines.front().text, ',');
  Table table;
  for (const auto name : names) table[std::string(name)];
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const auto fields = split_row(lines[i].text, ',');
    if (fields.size() != names.size()) {
      fail_at(file, lines[i].number, "has {}, the header {}", counted(fields.size(), "field"), names.size());
    }
    for (std::size_t c = 0; c < names.size(); ++c) table.find(names[c])->second.emplace_back(fields[c]);
  }
  return table;
}

[[nodiscard]] Table read_table(const fs::path& file) { return table_of(file, read_text_lines(file)); }

[[nodiscard]] Table read_covariance_table(const fs::path& file) {
  const auto lines = read_text_lines(file);
  if (!lines.empty()) require_whole_columns(file, lines.front());
  Table table = table_of(file, lines);
  if (const auto statuses = table.find("status"); statuses != table.end()) {
    for (std::size_t i = 0; i < statuses->second.size(); ++i)
      require_known_status(file, lines[i + 1].number, statuses->second[i]);
  }
  if (const auto reasons = table.find("reasons"); reasons != table.end()) {
    for (std::size_t i = 0; i < reasons->second.size(); ++i)
      require_known_reasons(file, lines[i + 1].number, reasons->second[i]);
  }
  return table;
}

/// Throws std::runtime_error unless a table has these columns.
void require_columns(const fs::path& file, const Table& table,
                     std::initializer_list<std::string_view> names) {
  for (const auto name : names) {
    if (table.contains(name)) continue;
    fail(file, "has no column '{}'; copy the folder of the run again", name);
  }
}

/// Throws std::runtime_error unless a table has one row for each pose. Otherwise the files are of different
/// runs, or one was cut off.
void require_rows(const fs::path& file, const Table& table, std::size_t poses) {
  const std::size_t rows = table.begin()->second.size();
  if (rows == poses) return;
  fail(file, "has {} for {} in trajectory_tum.txt; copy the folder of the run again", counted(rows, "row"),
       counted(poses, "pose"));
}

/// Throws std::runtime_error unless the rows of a table have the stamps of the poses.
void require_stamps(const fs::path& file, const Table& table, const Trajectory& trajectory) {
  const auto& stamps = table.find("stamp_s")->second;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const auto stamp_ns = parse_seconds(stamps[i]);
    if (stamp_ns && is_same_stamp(*stamp_ns, trajectory.stamps_ns[i])) continue;
    fail(file,
         "the stamp of row {} is '{}', and {} in trajectory_tum.txt: they are of different runs; copy the "
         "folder of the run again",
         i + 1, stamps[i], format_seconds(trajectory.stamps_ns[i]));
  }
}

[[nodiscard]] double to_number(const std::string& text) {
  const auto numbers = parse_numbers(text);
  return numbers && numbers->size() == 1 ? numbers->front() : kNaN;
}

/// A column as numbers, NaN for empty fields. Throws std::runtime_error for other text.
[[nodiscard]] std::vector<double> column(const fs::path& file, const Table& table, std::string_view name) {
  const auto& texts = table.find(name)->second;
  std::vector<double> values;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    values.push_back(to_number(texts[i]));
    if (!std::isnan(values.back()) || texts[i].empty() || texts[i] == "nan") continue;
    fail(file, "'{}' in the column '{}' of row {} is no number; copy the folder of the run again", texts[i],
         name, i + 1);
  }
  return values;
}

/// Collects the scalars below a node with the path of their keys.
void collect(const YAML::Node& node, const std::string& path, std::map<std::string, std::string>& entries) {
  if (node.IsScalar()) entries[path] = node.Scalar();
  if (!node.IsMap()) return;
  for (const auto& entry : node)
    collect(entry.second, path.empty() ? entry.first.Scalar() : path + "." + entry.first.Scalar(), entries);
}

/// Throws std::runtime_error unless the file has what every run.yaml has. `settings` is its last group, so a
/// file that was cut off lacks it, or the end of the last line, unless it was cut between two settings.
void require_entries_of_run(const fs::path& file, const std::map<std::string, std::string>& entries) {
  const auto setting = entries.lower_bound("settings.");
  const bool has_settings = setting != entries.end() && setting->first.starts_with("settings.");
  if (!entries.contains("version") || !entries.contains("state") || !has_settings) {
    fail(file, "is not of a run, or was cut off; give the --output folders of `stereo_slam run`");
  }
  require_line_end(file, read_text_lines(file));
}

[[nodiscard]] std::map<std::string, std::string> read_run_yaml(const fs::path& file) {
  if (!fs::is_regular_file(file)) {
    fail(file, "not found; give the --output folders of `stereo_slam run`");
  }
  std::map<std::string, std::string> entries;
  collect(load_yaml_file(file), "", entries);
  require_entries_of_run(file, entries);
  return entries;
}

void add_covariances(const fs::path& file, RunFolder& run) {
  const Table table = read_covariance_table(file);
  require_columns(file, table, {"stamp_s", "status", "tx_tx_m2", "ty_ty_m2", "tz_tz_m2", "nis", "nis_dof"});
  require_rows(file, table, run.trajectory.poses.size());
  require_stamps(file, table, run.trajectory);
  const auto x = column(file, table, "tx_tx_m2"), y = column(file, table, "ty_ty_m2"),
             z = column(file, table, "tz_tz_m2");
  const auto nis = column(file, table, "nis"), dof = column(file, table, "nis_dof");
  for (std::size_t k = 0; k < x.size(); ++k) {
    for (const double variance : {x[k], y[k], z[k]}) {
      if (!(variance >= 0.0))  // nor NaN
        fail(file, "row {} has a variance below zero, or none; copy the file again", k + 1);
    }
    run.sigma_m.push_back(std::sqrt(x[k] + y[k] + z[k]));
    run.nis_per_dof.push_back(dof[k] > 0.0 ? nis[k] / dof[k] : kNaN);
  }
  run.lost = static_cast<std::size_t>(std::ranges::count(table.find("status")->second, "LOST"));
}

void add_timing(const fs::path& file, RunFolder& run) {
  const Table table = read_table(file);
  require_columns(file, table, {"total_ms", "rss_mb"});
  require_rows(file, table, run.trajectory.poses.size());
  run.total_ms = column(file, table, "total_ms");
  run.resident_mb = column(file, table, "rss_mb");
}

void add_loops(const fs::path& file, RunFolder& run) {
  const Table table = read_table(file);
  require_columns(file, table, {"verdict"});
  run.accepted_loops =
      static_cast<std::size_t>(std::ranges::count(table.find("verdict")->second, "accepted"));
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
  const bool running = run.entry("state") == "running";
  for (const auto* name : {"trajectory_tum.txt", "covariances.csv", "timing.csv", "loops.csv"}) {
    if (fs::is_regular_file(folder / name)) continue;
    if (run.problem.empty()) {
      run.problem = fmt::format("has no {}; {}", name,
                                running ? "the run has not ended" : "copy the folder of the run again");
    }
    return run;
  }
  if (fs::file_size(folder / "trajectory_tum.txt") == 0) {
    const fs::path covariances = folder / "covariances.csv";
    require_rows(covariances, read_table(covariances), 0);
    if (run.problem.empty() && !running) run.problem = "trajectory_tum.txt is empty: no frame was processed";
    return run;
  }
  run.trajectory = read_trajectory(folder / "trajectory_tum.txt", TrajectoryFormat::kTum);
  add_covariances(folder / "covariances.csv", run);
  add_timing(folder / "timing.csv", run);
  add_loops(folder / "loops.csv", run);
  return run;
}

}  // namespace stereo_slam::report
