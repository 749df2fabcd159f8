// SPDX-License-Identifier: MIT
// The corpora of the fuzz targets, through the same functions, without libFuzzer.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "fuzz/fuzz_target.hpp"
#include "support/catch.hpp"
#include "support/files.hpp"

using namespace antipode;

namespace {

namespace fs = std::filesystem;

[[nodiscard]] std::vector<fs::path> entries(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// The claims that the file breaks, or nothing.
[[nodiscard]] std::string failure(const fuzz::Target& target, const std::string& text) {
  try {
    target.run({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("What the fuzz targets claim holds for their corpora, and for parts of them", "[fuzz]") {
  for (const auto& target : fuzz::targets()) {
    const fs::path folder = fs::path(FUZZ_CORPUS) / target.name;
    REQUIRE(fs::is_directory(folder));
    CHECK(failure(target, "") == "");
    for (const auto& file : entries(folder)) {
      CAPTURE(file.string());
      const std::string text = test::read_text(file);
      CHECK(failure(target, text) == "");
      CHECK(failure(target, text.substr(0, text.size() / 2)) == "");
    }
  }
}

TEST_CASE("Every corpus belongs to a fuzz target", "[fuzz]") {
  const auto all = fuzz::targets();
  for (const auto& folder : entries(FUZZ_CORPUS)) {
    CAPTURE(folder.string());
    CHECK(std::any_of(all.begin(), all.end(),
                      [&](const auto& target) { return target.name == folder.filename().string(); }));
  }
}
