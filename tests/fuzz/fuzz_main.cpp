// SPDX-License-Identifier: MIT
// libFuzzer's entry points: fuzz --target=NAME [libFuzzer's options] [corpus folders].
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include <opencv2/core/utility.hpp>

#include "fuzz/fuzz_target.hpp"

namespace {

antipode::fuzz::Target chosen;  // libFuzzer's interface has no place for it

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  constexpr std::string_view kOption = "--target=";
  cv::setNumThreads(1);  // a second one would wait for work most of the time
  const auto all = antipode::fuzz::targets();
  for (int i = 1; i < *argc; ++i) {
    const std::string_view argument = (*argv)[i];
    if (!argument.starts_with(kOption)) continue;
    for (const auto& target : all) {
      if (target.name == argument.substr(kOption.size())) chosen = target;
    }
  }
  if (chosen.run != nullptr) return 0;
  std::fputs("usage: fuzz --target=NAME [OPTION...] [FOLDER...], with one of these names:\n", stderr);
  for (const auto& target : all) std::fprintf(stderr, "%s\n", target.name.data());
  std::exit(2);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  chosen.run({bytes, size});
  return 0;
}
