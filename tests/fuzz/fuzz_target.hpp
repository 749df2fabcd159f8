// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

/// Functions that take any bytes. libFuzzer looks for bytes that break their claims (fuzz_main.cpp); a test
/// of the normal build repeats the corpora (replay_test.cpp).
namespace antipode::fuzz {

using Bytes = std::span<const std::uint8_t>;

/// A function that returns for every input; the name is that of its folder in corpus/.
struct Target {
  std::string_view name;
  void (*run)(Bytes bytes);
};

/// Thrown by require().
struct BrokenClaim : std::logic_error {
  using std::logic_error::logic_error;
};

inline void require(bool claim, const std::string& what) {
  if (!claim) throw BrokenClaim(what);
}

/// Runs a function that may refuse its arguments as the library does, and in no other way. The messages
/// begin with `about`, the name of the argument.
template <class Function>
void allow_refusal(const Function& function, std::string_view about = "") {
  try {
    function();
  } catch (const std::invalid_argument& error) {
    require(std::string_view(error.what()).starts_with(about), std::string("refused: ") + error.what());
  } catch (const std::domain_error& error) {  // a singular density has no logarithm
    require(about.empty(), std::string("refused: ") + error.what());
  }
}

[[nodiscard]] std::vector<Target> parser_targets();
[[nodiscard]] std::vector<Target> bag_targets();
[[nodiscard]] std::vector<Target> imu_targets();
[[nodiscard]] std::vector<Target> geometry_targets();
[[nodiscard]] std::vector<Target> distribution_targets();
[[nodiscard]] std::vector<Target> likelihood_update_targets();
[[nodiscard]] std::vector<Target> linear_update_targets();
[[nodiscard]] std::vector<Target> pose_graph_targets();

/// All targets.
[[nodiscard]] std::vector<Target> targets();

}  // namespace antipode::fuzz
