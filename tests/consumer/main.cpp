// SPDX-License-Identifier: MIT
#include <iostream>

#include <antipode/distributions/bingham.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

int main() {
  const auto T_a_b =
      antipode::DualQuaternion<double>::exp(antipode::Vector6<double>(0, 0, 1.5707963267948966, 1, 0, 0));
  const auto orientation = antipode::Bingham<double, 4>::uniform();
  const antipode::Vector3<double> p_a = T_a_b.inverse() * (T_a_b * antipode::Vector3<double>(1, 2, 3));
  std::cout << T_a_b << ' ' << orientation.log_normalizer() << '\n';
  const bool right = (p_a - antipode::Vector3<double>(1, 2, 3)).norm() < 1e-14;
  return right ? 0 : 1;
}
