// SPDX-License-Identifier: MIT
// Mistakes of a user, one for each value of MISTAKE. concept_errors.cmake compiles them and reads the first
// error.
#include <cstddef>
#include <vector>

#include <antipode/antipode.hpp>

namespace {

using Pose = antipode::DualQuaternion<double>;
using Z = antipode::NoisyMeasurement<double, 3>;

struct NotAModel {};

[[maybe_unused]] double no_error(const Pose&) { return 0.0; }

[[maybe_unused]] void mistake() {
  const antipode::PoseGaussian<double> prior{Pose::identity(), antipode::Matrix6<double>::Identity()};
  const std::vector<Z> z;
  const auto position = [](const Pose& x, std::size_t) { return antipode::Vector3<double>(x.translation()); };
#if MISTAKE == 0
  (void)quadratic_update(prior, no_error);
#elif MISTAKE == 1
  (void)quadratic_update(prior, NotAModel{});
#elif MISTAKE == 2
  (void)quadratic_update(prior, antipode::GaussianMeasurements(z, NotAModel{}));
#elif MISTAKE == 3
  (void)quadratic_update(to_bingham_gaussian(prior), no_error);
#elif MISTAKE == 4
  (void)quadratic_update(prior, no_error, {}, antipode::CubatureRule<3>{});
#elif MISTAKE == 5
  (void)linearized_update(prior, z, [](const Pose& x) { return antipode::Vector3<double>(x.translation()); });
#elif MISTAKE == 6
  (void)gauss_newton_update(prior, z, position);
#elif MISTAKE == 7
  (void)progressive_update(to_bingham_gaussian(prior), NotAModel{}, antipode::RichPoseRule{});
#elif MISTAKE == 8
  antipode::LinearizedPoseFilter<double>(prior).update(no_error);
#elif MISTAKE == 9
  antipode::QuadraticPoseFilter<double>(prior).update(NotAModel{});
#elif MISTAKE == 10
  (void)linearized_update(prior, 3.0, position);
#elif MISTAKE == 11
  (void)progressive_update(prior, no_error, antipode::RichPoseRule{});
#elif MISTAKE == 12
  (void)quadratic_update(antipode::StateGaussian<antipode::VectorChart<double, 19> >{},
                         [](const antipode::Vector<double, 19>&) { return 0.0; });
#endif
}

}  // namespace
