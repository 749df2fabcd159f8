// SPDX-License-Identifier: MIT
#include "stereo_slam/results/run_folder.hpp"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <stdexcept>
#include <string>
#include <sys/file.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/results/output.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

constexpr auto kRunFile = "run.yaml";

[[nodiscard]] bool present(const fs::path& file) { return fs::exists(fs::symlink_status(file)); }

/// What a folder holds of an earlier run.
enum class Contents { kNothing, kKilledRun, kEndedRun };

/// Throws for names of results that belong to something else: folders, links, devices, and files without the
/// run.yaml of a run.
[[nodiscard]] Contents contents_of(const fs::path& folder) {
  std::string found;
  for (const auto* name : result_files()) {
    if (present(folder / name)) found = name;
    if (present(folder / name) && !fs::is_regular_file(fs::symlink_status(folder / name))) {
      fail(folder / name, fmt::format("is {} with the name of a result file; choose another --output",
                                      fs::is_directory(folder / name) ? "a folder" : "not an ordinary file"));
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
  return state == "running" ? Contents::kKilledRun : Contents::kEndedRun;
}

void create(const fs::path& folder) {
  if (folder.empty()) throw std::runtime_error("--output is empty; name a folder");
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && !fs::is_directory(folder)) error = std::make_error_code(std::errc::not_a_directory);
  if (error)
    fail(folder, fmt::format("cannot be used for output ({}); choose another --output", error.message()));
}

}  // namespace

RunFolder::RunFolder(fs::path folder, bool overwrite) : folder_(std::move(folder)), working_(folder_) {
  create(folder_);
  lock();
  try {
    const Contents contents = contents_of(folder_);
    if (contents == Contents::kNothing) return;
    if (!overwrite)
      fail(folder_,
           "holds the results of an earlier run; choose another --output, or replace them with --overwrite");
    if (contents == Contents::kKilledRun) return;
    working_ = folder_ / kUnfinished;
    create(working_);
    (void)contents_of(working_);
  } catch (...) {
    ::close(lock_);
    throw;
  }
}

RunFolder::~RunFolder() { ::close(lock_); }

void RunFolder::lock() {
  // The lock is on the folder itself: it leaves no file, and ends with the process.
  lock_ = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ >= 0 && ::flock(lock_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(lock_);
    fail(folder_, "another run is writing to it; wait for its end, or choose another --output");
  }
}

void RunFolder::publish() const {
  if (working_ == folder_) return;
  // Without its run.yaml the earlier run counts as replaced; the new one comes last.
  fs::remove(folder_ / kRunFile);
  for (const auto* name : result_files()) {
    if (present(working_ / name)) {
      fs::rename(working_ / name, folder_ / name);
    } else {
      fs::remove(folder_ / name);
    }
  }
  fs::rename(working_ / kRunFile, folder_ / kRunFile);
  std::error_code not_empty;
  fs::remove(working_, not_empty);
}

}  // namespace stereo_slam
