// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/io/folder_lock.hpp"

namespace stereo_slam {

/// The folder that a run writes to. No other run can use it while the object exists. The results of an
/// earlier run, which may have been killed, stay until this run has finished.
class RunFolder {
 public:
  /// Subfolder for the files of this run until they replace those of an earlier run.
  static constexpr const char* kUnfinished = "unfinished";

  /// Creates the folder. If an earlier run was killed in publish(), that is completed first. Throws
  /// std::runtime_error when the folder cannot be used, another run uses it, it holds results and `overwrite`
  /// is false, or it holds files with the names of results that no run wrote.
  RunFolder(std::filesystem::path folder, bool overwrite);

  /// Where this run writes: the folder, or `unfinished` in it while an earlier run's results stay.
  [[nodiscard]] const std::filesystem::path& working() const { return working_; }

  /// Throws std::runtime_error if the folder, or working(), was moved or removed since.
  void require_in_place() const;

  /// Moves the results of a finished run from working() to the folder. Throws std::runtime_error when that
  /// fails.
  void publish() const;

 private:
  std::filesystem::path folder_;
  std::filesystem::path working_;
  std::optional<FolderLock> lock_;
  std::optional<FolderLock> working_lock_;  // if working_ is another folder
};

/// Throws std::runtime_error if `file` is also the one that `option` names.
void require_other_file(const std::filesystem::path& file, const std::optional<std::filesystem::path>& other,
                        std::string_view option);

/// Throws std::runtime_error if the files of `option` would be written into a folder with images of the
/// recording. Debug images would belong to it then.
void require_other_folder(const std::filesystem::path& folder, std::string_view option,
                          const StereoSequence& sequence);

/// Throws std::runtime_error if `file` is `folder`, which need not exist yet, or a folder above it.
void require_no_folder_of(const std::filesystem::path& file, const std::filesystem::path& folder);

/// Throws std::runtime_error unless a run into `folder`, which need not exist yet, can also write `file`: it
/// must be possible to create it, and it must not have the path of a result.
void require_writable_besides_results(const std::filesystem::path& file, const std::filesystem::path& folder);

}  // namespace stereo_slam
