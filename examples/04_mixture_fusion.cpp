// SPDX-License-Identifier: MIT
//
// A box lies on a table. One camera sees a face of it, but all four sides look alike; another sees a long
// edge and cannot distinguish up from down. Each view leaves several poses. What do both say together, and
// where should a gripper reach?
//
//   T_world_box     the pose that is wanted
//   p = sum pi_i N  a mixture of projected Gaussians: what one view knows of T_world_box
//   u               tangent coordinates of a rotation, half a rotation vector [rad]
#include <cstdlib>
#include <iostream>
#include <numbers>
#include <random>

#include <antipode/antipode.hpp>

using Pose = antipode::DualQuaternion<double>;
using Vector6 = antipode::Vector6<double>;
using Component = antipode::ProjectedGaussian<double>;
using Mixture = antipode::Mixture<Component>;

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

void expect(bool holds, const char* what) {
  if (!holds) {
    std::cerr << "unexpected: " << what << '\n';
    std::exit(EXIT_FAILURE);
  }
}

Vector6 twist(const antipode::Vector3<double>& phi, const antipode::Vector3<double>& rho) {
  Vector6 xi;
  xi << phi, rho;
  return xi;
}

/// Equally likely poses seen * symmetry^k, each known to sigma (rotation [rad], translation [m]).
Mixture ambiguous(const Pose& seen, const Vector6& symmetry, int count, const Vector6& sigma) {
  std::vector<Mixture::Element> elements;
  for (int k = 0; k < count; ++k) {
    const Pose hypothesis = seen.boxplus(Vector6(k * symmetry));
    elements.push_back({1.0, antipode::to_projected_gaussian(antipode::PoseGaussian<double>{
                                 hypothesis, sigma.cwiseAbs2().asDiagonal()})});
  }
  return Mixture::normalized(elements);
}

}  // namespace

int main() {
  const Pose truth = Pose::exp(twist({0.1, 0.2, 0.9}, {2.0, 1.0, 0.7}));

  // Four sides alike: turned by quarters about the vertical. Seen with an error of 4 degrees and 2 cm.
  const Vector6 rough = twist({4 * kDegree, 4 * kDegree, 4 * kDegree}, {0.02, 0.02, 0.05});
  const Mixture face = ambiguous(truth.boxplus(twist({0, 0.04, -0.03}, {0.01, -0.01, 0.03})),
                                 twist({0, 0, 90 * kDegree}, {0, 0, 0}), 4, rough);
  // Upside down or not: turned by half about the edge, by a view that is good along other axes.
  const Vector6 fine = twist({8 * kDegree, 2 * kDegree, 2 * kDegree}, {0.05, 0.02, 0.02});
  const Mixture edge = ambiguous(truth.boxplus(twist({0.1, 0.01, 0.02}, {0.04, 0.01, -0.01})),
                                 twist({180 * kDegree, 0, 0}, {0, 0, 0}), 2, fine);

  const auto fused = antipode::fuse(face, edge);
  const auto& [weight, density] = fused.mixture.heaviest();
  const Vector6 error = truth.boxminus(density.pose());
  std::cout << "of 8 pairs of hypotheses " << fused.rejected_pairs << " are impossible, and one has "
            << 100 * weight << " %\nit is off by " << error.head<3>().norm() / kDegree << " deg and "
            << 100 * error.tail<3>().norm() << " cm\n";
  expect(weight > 0.999, "one answer is left");
  expect(error.head<3>().norm() < 4 * kDegree && error.tail<3>().norm() < 0.04, "it is the right one");

  // A gripper that forgives 6 degrees and 4 cm: where does it catch the box most often?
  const auto box = antipode::PoseBox<double>::symmetric(twist({0.1, 0.1, 0.1}, {0.04, 0.04, 0.04}));
  std::mt19937_64 rng(1);
  const auto grasp = antipode::best_grasp(fused.mixture, box, rng);
  std::cout << "a grasp succeeds with " << 100 * grasp.probability.value << " +- "
            << 100 * grasp.probability.standard_error << " %\n";
  expect(grasp.probability.value > 0.6, "the grasp is worth trying");
}
