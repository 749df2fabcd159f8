// SPDX-License-Identifier: MIT
#include "stereo_slam/results/run_folder.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/results/output.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

constexpr auto kRunFile = "run.yaml";

/// The absolute path, without symbolic links, and without a slash at its end.
[[nodiscard]] fs::path place_of(const fs::path& path) {
  const fs::path place = fs::weakly_canonical(fs::absolute(path));
  return place.has_filename() ? place : place.parent_path();
}

[[nodiscard]] bool present(const fs::path& file) { return fs::exists(fs::symlink_status(file)); }

/// Which results of an earlier run a folder holds.
enum class Contents { kNothing, kUnfinishedRun, kFinishedRun };

/// Throws std::runtime_error if something other than a result has the name of a result: a folder, link or
/// device, or a file without the run.yaml of a run.
[[nodiscard]] Contents contents_of(const fs::path& folder) {
  std::string found;
  for (const auto* name : result_files()) {
    if (present(folder / name)) found = name;
    if (present(folder / name) && !fs::is_regular_file(fs::symlink_status(folder / name))) {
      fail(folder / name, "is {} with the name of a result file; choose another --output",
           fs::is_directory(folder / name) ? "a folder" : "not an ordinary file");
    }
  }
  const fs::path header = folder / kRunFile;
  if (!present(header)) {
    if (found.empty()) return Contents::kNothing;
    fail(folder / found, "exists, and no run wrote it (there is no run.yaml); choose another --output");
  }
  if (!fs::is_regular_file(fs::symlink_status(header)))
    fail(header, "is not an ordinary file; choose another --output");
  bool has_version = false;
  std::string state;
  for (const auto& line : read_text_lines(header)) {
    constexpr std::string_view kState = "state: ";
    has_version = has_version || line.text.starts_with("version: ");
    if (line.text.starts_with(kState)) state = line.text.substr(kState.size());
  }
  if (!has_version || state.empty()) fail(header, "is not of a run; choose another --output");
  return state == "finished" ? Contents::kFinishedRun : Contents::kUnfinishedRun;
}

void remove_file(const fs::path& file) {
  std::error_code error;
  fs::remove(file, error);
  if (error) fail(file, "cannot be removed ({}); allow that, or choose another --output", error.message());
}

/// Moves the results that are in a folder into another one, run.yaml last, and removes the folder.
void move_results(const fs::path& from, const fs::path& to) {
  const auto move = [&](const char* name) {
    std::error_code error;
    fs::rename(from / name, to / name, error);
    if (error)
      fail(to / name, "cannot be replaced ({}); the result is in {}", error.message(), from.string());
  };
  for (const auto* name : result_files()) {
    if (present(from / name)) move(name);
  }
  move(kRunFile);
  std::error_code unreadable;
  for (const auto& file : fs::directory_iterator(from, unreadable)) {
    if (is_partial(file.path())) remove_file(file.path());  // left by a run that was killed
  }
  std::error_code not_empty;
  fs::remove(from, not_empty);
}

/// Completes the publish() of a run that was killed in it, which the missing run.yaml in the folder shows.
void complete_publication(const fs::path& folder) {
  const fs::path unfinished = folder / RunFolder::kUnfinished;
  if (present(folder / kRunFile) || !fs::is_directory(fs::symlink_status(unfinished)) ||
      !present(unfinished / kRunFile)) {
    return;
  }
  if (contents_of(unfinished) == Contents::kFinishedRun) move_results(unfinished, folder);
}

void create(const fs::path& folder) {
  if (folder.empty()) throw std::runtime_error("--output is empty; name a folder");
  std::error_code error;
  if (fs::is_symlink(fs::symlink_status(folder, error)) &&
      fs::status(folder, error).type() == fs::file_type::not_found)
    fail(folder, "is a symbolic link that leads nowhere; choose another --output");
  fs::create_directories(folder, error);
  if (!error && !fs::is_directory(folder)) error = std::make_error_code(std::errc::not_a_directory);
  if (error) fail(folder, "cannot be used for output ({}); choose another --output", error.message());
}

}  // namespace

RunFolder::RunFolder(fs::path folder, bool overwrite) : folder_(std::move(folder)), working_(folder_) {
  create(folder_);
  lock_.emplace(folder_, "--output");
  complete_publication(folder_);
  if (contents_of(folder_) == Contents::kNothing) return;
  if (!overwrite)
    fail(folder_,
         "holds the results of an earlier run; choose another --output, or replace them with --overwrite");
  working_ = folder_ / kUnfinished;
  if (fs::is_symlink(fs::symlink_status(working_)))
    fail(working_, "is a symbolic link, which no run made; remove it, or choose another --output");
  create(working_);
  working_lock_.emplace(working_, "--output");
  (void)contents_of(working_);
}

void RunFolder::require_in_place() const {
  lock_->require_in_place();
  if (working_lock_) working_lock_->require_in_place();
}

void RunFolder::publish() const {
  if (working_ == folder_) return;
  for (const auto* name : result_files()) {
    if (!present(working_ / name)) remove_file(folder_ / name);
  }
  // Once the earlier run's run.yaml is gone, a next run would complete the move if this one were killed.
  remove_file(folder_ / kRunFile);
  move_results(working_, folder_);
}

void require_other_file(const fs::path& file, const std::optional<fs::path>& other, std::string_view option) {
  if (other && place_of(file) == place_of(*other))
    fail(file, "is the file of {}, too; name another file", option);
}

void require_other_folder(const fs::path& folder, std::string_view option, const StereoSequence& sequence) {
  if (sequence.frames.empty()) return;
  std::error_code error;
  for (const auto& image : {sequence.frames.front().left, sequence.frames.front().right}) {
    const bool beside_link = fs::equivalent(folder, image.parent_path(), error) && !error;
    const bool beside_image =
        fs::equivalent(folder, fs::canonical(image, error).parent_path(), error) && !error;
    if (!beside_link && !beside_image) continue;
    fail(folder, "has the images of the recording; choose another folder for {}", option);
  }
}

void require_no_folder_of(const fs::path& file, const fs::path& folder) {
  const fs::path place = place_of(file);
  for (fs::path above = place_of(folder);; above = above.parent_path()) {
    if (above == place) fail(file, "will be a folder, for {}; name a file", folder.string());
    if (above == above.parent_path()) return;
  }
}

void require_writable_besides_results(const fs::path& file, const fs::path& folder) {
  require_no_folder_of(file, folder);
  const fs::path place = place_of(file);
  const fs::path results = place_of(folder);
  const auto is_place_of = [&](const char* name) { return place == results / name; };
  const bool in_unfinished =
      is_place_of(RunFolder::kUnfinished) || place.parent_path() == results / RunFolder::kUnfinished;
  if (in_unfinished || is_place_of(kRunFile) ||
      std::any_of(result_files().begin(), result_files().end(), is_place_of))
    fail(file, "is the name of a result file in --output; name another file");
  if (place.parent_path() != results) require_writable(file);  // in --output itself, which RunFolder checks
}

}  // namespace stereo_slam
