// SPDX-License-Identifier: MIT
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <typeinfo>

#include "fuzz/fuzz_target.hpp"

/// What targets that read files share.
namespace antipode::fuzz {

/// A folder for the files that are read, in memory where that exists.
class Folder {
 public:
  Folder() {
    std::string name = ((std::filesystem::is_directory("/dev/shm") ? std::filesystem::path("/dev/shm")
                                                                   : std::filesystem::temp_directory_path()) /
                        "antipode_fuzz_XXXXXX");
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder at " + name);
    path_ = name;
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  [[nodiscard]] std::filesystem::path write(const std::string& name, Bytes bytes) const {
    const std::filesystem::path file = path_ / name;
    std::ofstream stream(file, std::ios::binary);
    if (!stream) {
      std::filesystem::create_directories(file.parent_path());
      stream.open(file, std::ios::binary);
    }
    stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    require(stream.good(), "the fuzzer cannot write " + file.string());
    return file;
  }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

[[nodiscard]] inline const Folder& folder() {
  static const Folder folder;
  return folder;
}

/// Runs a reader. Only a std::runtime_error that names the file or its folder may come out.
template <class Read>
void attempt_to_read(const Read& read) {
  try {
    read();
  } catch (const std::runtime_error& error) {
    const std::string message = error.what();
    require(typeid(error) == typeid(std::runtime_error), "an error of another library: " + message);
    require(message.find(folder().path().string()) != std::string::npos, "names no file: " + message);
  }
}

}  // namespace antipode::fuzz
