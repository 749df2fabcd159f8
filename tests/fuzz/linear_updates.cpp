// SPDX-License-Identifier: MIT
// Updates by measurement models that may be anything.
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <antipode/distributions/gaussian.hpp>
#include <antipode/filters/gauss_newton_update.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/robust_least_squares.hpp>
#include <antipode/filters/unscented_update.hpp>

#include "fuzz/fuzz_target.hpp"
#include "fuzz/hostile_input.hpp"
#include "fuzz/hostile_measurement.hpp"

namespace antipode::fuzz {
namespace {

using Scalar1 = Vector<double, 1>;

/// Measured numbers, each a hostile function of the pose. What is -infinity cannot be predicted.
struct HostileModel {
  std::vector<AnyFunction> functions;
  Matrix<double, 1, 6> J;  ///< a Jacobian that need not be that of the functions

  [[nodiscard]] std::optional<Scalar1> operator()(const DualQuaternion<double>& x, std::size_t i) const {
    const double value = functions[i](x);
    if (value == -std::numeric_limits<double>::infinity()) return std::nullopt;
    return Scalar1(value);
  }
  [[nodiscard]] std::optional<Scalar1> operator()(const DualQuaternion<double>& x, std::size_t i,
                                                  Matrix<double, 1, 6>& jacobian) const {
    jacobian = J;
    return (*this)(x, i);
  }
};

/// A prior, measurements and their model.
struct HostileProblem {
  PoseGaussian<double> prior;
  std::vector<NoisyMeasurement<double, 1>> measurements;
  HostileModel model;

  explicit HostileProblem(HostileInput& input) : prior(hostile_prior(input)) {
    for (unsigned count = 1 + input.choice(3); count > 0; --count) {
      const double variance = input.choice(4) == 0 ? input.number() : input.scale();
      measurements.push_back({Scalar1(input.number()), Matrix<double, 1>(variance)});
      model.functions.push_back(hostile_function(input));
    }
    model.J = input.numbers<1, 6>();
  }
};

void linearized(Bytes bytes) {
  HostileInput input(bytes);
  const HostileProblem problem(input);
  LinearizedUpdateOptions<double> options;
  options.robust = static_cast<RobustWeight>(input.choice(3));
  allow_refusal(
      [&] {
        const auto& [prior, measurements, model] = problem;
        require_honest(linearized_update(prior, measurements, model, options), prior);
      },
      "pose covariance");
}

void gauss_newton(Bytes bytes) {
  HostileInput input(bytes);
  const HostileProblem problem(input);
  allow_refusal(
      [&] {
        const auto& [prior, measurements, model] = problem;
        require_honest(gauss_newton_update(prior, measurements, model), prior);
      },
      "pose covariance");
}

template <class Noise>
void least_squares_with(const Noise& noise, const HostileProblem& problem, HostileInput& input) {
  using Poses = ScrewChart<double>;
  const auto add_all = [&](const DualQuaternion<double>& x, auto& sums) {
    for (std::size_t i = 0; i < problem.measurements.size(); ++i) {
      Matrix<double, 1, 6> J;
      const auto z = problem.model(x, i, J);
      if (!z) {
        sums.miss(1);
        continue;
      }
      for (int row = 0; row < 8; ++row) {  // enough for residuals: the same with other derivatives
        J[row % 6] += 1.0;
        sums.add(Scalar1(problem.measurements[i].z - *z), Scalar1(1.0 / problem.measurements[i].R(0, 0)), J);
      }
    }
  };
  const LeastSquaresOptions<double> options{.covariance = static_cast<CovarianceFrom>(input.choice(3)),
                                            .check_modes = input.choice(2) == 0};
  const bool has_prior = input.choice(2) == 0;
  std::optional<LeastSquaresPrior<Poses>> prior;
  if (has_prior)
    prior = LeastSquaresPrior<Poses>::from_covariance(problem.prior.pose, problem.prior.covariance);
  const auto result =
      robust_least_squares<Poses>(problem.prior.pose, add_all, noise, options, prior ? &*prior : nullptr);
  require(result.state.coeffs().allFinite(), "the state is not finite");
  if (!result.converged()) return;
  try {
    (void)Gaussian<double, 6>(Vector6<double>::Zero(), result.covariance);
  } catch (const std::invalid_argument& error) {
    require(false, std::string("converged to no covariance: ") + error.what());
  }
}

void least_squares(Bytes bytes) {
  HostileInput input(bytes);
  const HostileProblem problem(input);
  const unsigned kind = input.choice(4);
  allow_refusal(
      [&] {
        if (kind == 0) least_squares_with(NormalNoise<double>{}, problem, input);
        if (kind == 1) least_squares_with(CauchyLoss<double>{}, problem, input);
        if (kind == 2) least_squares_with(StudentT<double>{}, problem, input);
        if (kind == 3) least_squares_with(Contamination<double>{}, problem, input);
      },
      "covariance of the prior");
}

/// A point measured from a known pose.
void unscented(Bytes bytes) {
  HostileInput input(bytes);
  std::optional<Gaussian<double, 3>> any;
  allow_refusal([&] {
    const Vector3<double> center = input.choice(4) == 0 ? input.numbers<3>() : input.ordinary_numbers<3>();
    any.emplace(center.unaryExpr(&bounded), input.covariance<3>().unaryExpr(&bounded));
  });
  if (!any) return;
  const auto& prior = *any;
  const std::vector<AnyFunction> functions = {hostile_function(input), hostile_function(input)};
  const NoisyMeasurement<double, 2> measurement{input.numbers<2>(), input.covariance<2>()};
  const auto h = [&](const DualQuaternion<double>& pose,
                     const Vector3<double>& x) -> std::optional<Vector2<double>> {
    if (!x.allFinite()) return std::nullopt;
    const auto at = DualQuaternion<double>::from_rotation_translation(pose.rotation(), x);
    const Vector2<double> z(functions[0](at), functions[1](at));
    if (z[0] == -std::numeric_limits<double>::infinity()) return std::nullopt;
    return z;
  };
  allow_refusal(
      [&] {
        const auto result = unscented_update(prior, DualQuaternion<double>::identity(), h, measurement);
        if (result.status != UnscentedUpdateStatus::kUpdated) {
          require(result.posterior.mean() == prior.mean(), "a failed update does not return the prior");
          return;
        }
        require(result.posterior.mean().allFinite() && result.posterior.covariance().allFinite(),
                "updated to no density");
        require(std::isfinite(result.nis) && result.nis >= 0.0,
                "the innovation is no number: " + std::to_string(result.nis));
      },
      "measurement");
}

}  // namespace

std::vector<Target> linear_update_targets() {
  return {{"linearized_update", linearized},
          {"gauss_newton_update", gauss_newton},
          {"robust_least_squares", least_squares},
          {"unscented_update", unscented}};
}

}  // namespace antipode::fuzz
