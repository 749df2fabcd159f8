// SPDX-License-Identifier: MIT
#include "fuzz/fuzz_target.hpp"

namespace antipode::fuzz {

std::vector<Target> targets() {
  std::vector<Target> all;
  for (const auto& group :
       {parser_targets(), bag_targets(), imu_targets(), geometry_targets(), distribution_targets(),
        likelihood_update_targets(), linear_update_targets(), pose_graph_targets()}) {
    all.insert(all.end(), group.begin(), group.end());
  }
  return all;
}

}  // namespace antipode::fuzz
