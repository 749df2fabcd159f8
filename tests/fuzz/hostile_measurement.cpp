// SPDX-License-Identifier: MIT
#include "fuzz/hostile_measurement.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <antipode/detail/positive_semidefinite.hpp>

#include "fuzz/fuzz_target.hpp"

namespace antipode::fuzz {
namespace {

/// A function of the pose that may jump, be infinite, or be no number; the same for x and -x.
struct HostileTerm {
  unsigned kind = 0;
  double strength = 1.0;
  double offset = 0.0;
  Vector6<double> direction = Vector6<double>::Zero();

  explicit HostileTerm(HostileInput& input)
      : kind(input.choice(10)), strength(input.number()), offset(input.ordinary()) {
    direction = input.ordinary_numbers<6>();
  }

  [[nodiscard]] double operator()(const DualQuaternion<double>& x) const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Vector6<double> coordinates;
    coordinates << x.canonical().real().tail<3>(), x.translation();
    const double s = direction.dot(coordinates) - offset;
    switch (kind) {
      case 0:
        return -std::abs(strength) * s * s;
      case 1:
        return s > 0.0 ? -kInfinity : 0.0;
      case 2:
        return s > 0.0 ? std::numeric_limits<double>::quiet_NaN() : -s * s;
      case 3:
        return strength * s;
      case 4:
        return s > 0.0 ? strength : 0.0;
      case 5:
        return strength * std::sin(1.0 / s);
      case 6:
        return s > 0.0 ? kInfinity : 0.0;
      case 7:
        return strength;
      case 8:
        return -std::abs(strength) * std::pow(std::abs(s) - 1.0, 2);
      default:
        return -std::abs(strength) * std::min(std::abs(s), 1.0);
    }
  }
};

/// A covariance in one line, for messages.
[[nodiscard]] std::string to_text(const Matrix6<double>& P) {
  std::ostringstream text;
  text << std::setprecision(17);
  for (const double value : P.reshaped()) text << ' ' << value;
  return text.str();
}

/// Whether the next update would take it.
[[nodiscard]] bool is_covariance(const Matrix6<double>& P) {
  try {
    (void)detail::root_of_covariance<double, 6>("", detail::checked_symmetric<double, 6>("", P));
  } catch (const std::invalid_argument&) {
    return false;
  }
  return true;
}

void require_figures(double log_evidence, double nis, double residual) {
  std::ostringstream text;
  text << "converged with log evidence " << log_evidence << ", innovation " << nis << ", residual "
       << residual;
  require(std::isfinite(log_evidence) && std::isfinite(nis) && std::isfinite(residual), text.str());
}

}  // namespace

AnyFunction hostile_function(HostileInput& input) {
  std::vector<HostileTerm> terms;
  for (unsigned count = 1 + input.choice(4); count > 0; --count) terms.emplace_back(input);
  return [terms](const DualQuaternion<double>& x) {
    double sum = 0.0;
    for (const auto& term : terms) sum += term(x);
    return sum;
  };
}

double bounded(double x) { return std::isfinite(x) ? std::clamp(x, -1e100, 1e100) : x; }

PoseGaussian<double> hostile_prior(HostileInput& input) {
  Vector6<double> twist = input.ordinary_numbers<6>();
  if (input.choice(4) == 0) twist.tail<3>() *= std::min(input.scale(), 1e50);
  const auto pose = DualQuaternion<double>::exp(twist);
  return {pose, input.covariance<6>().unaryExpr(&bounded)};
}

void require_honest(const PoseUpdateResult<double>& result, const PoseGaussian<double>& prior) {
  const auto& [pose, covariance] = result.posterior;
  if (result.status == UpdateStatus::kNoSupport || result.status == UpdateStatus::kNotFinite) {
    require(pose.coeffs() == prior.pose.coeffs() && covariance == prior.covariance,
            "a failed update does not return the prior");
  }
  if (result.status != UpdateStatus::kConverged) return;
  require(pose.coeffs().allFinite(), "converged to no pose");
  require(is_covariance(covariance),
          "converged to no covariance:" + to_text(covariance) + " from" + to_text(prior.covariance));
  require_figures(result.log_evidence, result.nis, result.residual);
}

void require_honest(const ProgressiveResult<double>& result) {
  if (result.status != UpdateStatus::kConverged) return;
  const auto& posterior = result.posterior;
  require(posterior.mean_translation().allFinite(), "converged to no pose");
  require(is_covariance(posterior.covariance()),
          "converged to no covariance:" + to_text(posterior.covariance()));
  require_figures(result.log_evidence, result.nis, result.residual);
}

}  // namespace antipode::fuzz
