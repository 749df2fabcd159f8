// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/filters/gauss_newton_update.hpp>
#include <antipode/filters/robust_least_squares.hpp>

#include "filters/linear_problem.hpp"
#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/no_allocation.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using Poses = ScrewChart<double>;
using R3 = VectorChart<double, 3>;

/// What a camera measures of known landmarks; a share of the measurements belong to other landmarks.
struct CameraProblem {
  Pose truth;
  StereoScene<double> scene;
  StereoWithJacobian h;
  Matrix3<double> S_inverse;

  CameraProblem(Rng& rng, int count, double share, double noise = 1.0)
      : truth(random_pose<double>(rng)),
        scene(StereoScene<double>::random(rng, truth, count)),
        h{scene.camera, scene.landmarks},
        S_inverse(scene.sigma.cwiseAbs2().cwiseInverse().asDiagonal()) {
    const auto elsewhere = StereoScene<double>::random(rng, truth, count);
    for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
      const Vector3<double> exact = scene.camera(truth, scene.landmarks[i]).value();
      scene.measurements[i] = exact + noise * (scene.measurements[i] - exact);
      if (uniform<double>(rng, 0.0, 1.0) < share) scene.measurements[i] = elsewhere.measurements[i];
    }
  }
  template <class Sums>
  void operator()(const Pose& x, Sums& sums) const {
    Matrix<double, 3, 6> J;
    for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
      const auto z = h(x, i, J);
      if (z) {
        sums.add(Vector3<double>(scene.measurements[i] - *z), S_inverse, J);
      } else {
        sums.miss(3);
      }
    }
  }
};

[[nodiscard]] double nees(const LeastSquaresResult<Poses>& result, const Pose& truth) {
  return test::nees(PoseGaussian<double>{result.state, result.covariance}, truth);
}

constexpr LeastSquaresOptions<double> kByNoise{.covariance = CovarianceFrom::kNoise};

/// Pose errors of a tenth of a radian and half a metre, from which the steps start.
[[nodiscard]] Pose near(Rng& rng, const Pose& truth) {
  return draw(rng, PoseGaussian<double>{truth, pose_covariance<double>(0.03, 0.3)});
}

}  // namespace

TEST_CASE("Normal noise and a linear model give the weighted least squares of a dense solve",
          "[least-squares]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const LinearProblem<3, 0> problem(rng, 12);
    Eigen::MatrixXd A(24, 3);
    Eigen::VectorXd b(24);
    for (std::size_t i = 0; i < problem.rows.size(); ++i) {
      const auto& row = problem.rows[i];
      const Matrix2<double> U = row.S_inverse.llt().matrixU();
      A.middleRows<2>(2 * static_cast<Eigen::Index>(i)) = U * row.J;
      b.segment<2>(2 * static_cast<Eigen::Index>(i)) = U * row.z;
    }
    const Eigen::Vector3d x = A.colPivHouseholderQr().solve(b);
    const auto result = robust_least_squares<R3>(R3::Point::Zero(), problem, NormalNoise<double>{}, kByNoise);
    CHECK(result.converged());
    CHECK(max_difference(result.state, x) < 1e-12);
    CHECK(max_difference(result.covariance, (A.transpose() * A).inverse()) < 1e-12);
    CHECK(result.squared_distance == Approx((A * x - b).squaredNorm()).epsilon(1e-12));
    CHECK(result.numbers == 24);
    // By the residuals: the same times their mean square, with 21 degrees of freedom.
    const auto by_residuals = robust_least_squares<R3>(R3::Point::Zero(), problem, NormalNoise<double>{});
    CHECK(by_residuals.covariance.trace() > 0.0);
  }
}

TEST_CASE("Units that are sixteen orders of magnitude apart change nothing", "[least-squares]") {
  Rng rng(1);
  LinearProblem<3, 0> problem(rng, 12);
  const auto plain = robust_least_squares<R3>(R3::Point::Zero(), problem, CauchyLoss<double>{});
  const Vector3<double> units(1e-8, 1.0, 1e8);
  for (auto& row : problem.rows) row.J = row.J * units.asDiagonal();
  const auto scaled = robust_least_squares<R3>(R3::Point::Zero(), problem, CauchyLoss<double>{});
  REQUIRE(scaled.status == plain.status);
  for (int i = 0; i < 3; ++i) {
    CHECK(units[i] * scaled.state[i] == Approx(plain.state[i]).epsilon(1e-6));
    CHECK(units[i] * units[i] * scaled.covariance(i, i) == Approx(plain.covariance(i, i)).epsilon(1e-6));
  }
}

TEST_CASE("States of several problems and what they share come out as from one dense problem",
          "[least-squares][considered]") {
  constexpr int kProblems = 4;
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    // The unknowns are three numbers for each problem, and two that all share.
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(3 * kProblems + 2, 3 * kProblems + 2);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(H.rows());
    GaussianInformation<double, 2> shared{Matrix2<double>::Identity(), Vector2<double>(0.3, -0.2)};
    H.bottomRightCorner<2, 2>() = shared.information;
    b.tail<2>() = shared.vector;
    std::vector<LeastSquaresResult<R3, 2>> results;
    for (int k = 0; k < kProblems; ++k) {
      const LinearProblem<3, 2> problem(rng, 8);
      results.push_back(
          robust_least_squares<R3, 2>(R3::Point::Zero(), problem, NormalNoise<double>{}, kByNoise));
      shared = shared + results.back().considered;
      for (const auto& row : problem.rows) {
        Eigen::MatrixXd all = Eigen::MatrixXd::Zero(2, H.cols());
        all.middleCols<3>(3 * k) = row.J;
        all.rightCols<2>() = row.K;
        H += all.transpose() * row.S_inverse * all;
        b += all.transpose() * row.S_inverse * row.z;
      }
    }
    const Eigen::VectorXd x = H.ldlt().solve(b);
    const Eigen::MatrixXd P = H.inverse();
    CHECK(max_difference(shared.mean(), x.tail<2>()) < 1e-11);
    CHECK(max_difference(shared.covariance(), P.bottomRightCorner<2, 2>()) < 1e-11);
    for (int k = 0; k < kProblems; ++k) {
      const auto& result = results[static_cast<std::size_t>(k)];
      const Vector3<double> state = result.state + result.sensitivity * shared.mean();
      CHECK(max_difference(state, x.segment<3>(3 * k)) < 1e-11);
      CHECK(max_difference(result.covariance_with(shared.covariance()), P.block<3, 3>(3 * k, 3 * k)) < 1e-11);
      CHECK(max_difference(result.cross_covariance(shared.covariance()),
                           P.block<3, 2>(3 * k, 3 * kProblems)) < 1e-11);
    }
  }
}

TEST_CASE("A prior with its cross-covariance is another measurement of state and considered parameters",
          "[least-squares][considered]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Matrix<double, 5> joint = random_covariance<double, 5>(rng);
    const Vector3<double> mean = random_matrix<double, 3, 1>(rng);
    const LinearProblem<3, 2> problem(rng, 6);
    const auto prior = LeastSquaresPrior<R3, 2>::from_covariance(
        mean, joint.topLeftCorner<3, 3>(), joint.topRightCorner<3, 2>(), joint.bottomRightCorner<2, 2>());
    const auto result =
        robust_least_squares<R3, 2>(R3::Point::Zero(), problem, NormalNoise<double>{}, kByNoise, &prior);
    REQUIRE(result.converged());
    Matrix<double, 5> H = joint.inverse();
    Vector<double, 5> b = H.leftCols<3>() * mean;
    for (const auto& row : problem.rows) {
      Matrix<double, 2, 5> all;
      all << row.J, row.K;
      H += all.transpose() * row.S_inverse * all;
      b += all.transpose() * row.S_inverse * row.z;
    }
    const Vector<double, 5> x = H.ldlt().solve(b);
    const Matrix<double, 5> P = H.inverse();
    const GaussianInformation<double, 2> before{joint.bottomRightCorner<2, 2>().inverse(),
                                                Vector2<double>::Zero()};
    const auto shared = before + result.considered;
    CHECK(max_difference(shared.mean(), x.tail<2>()) < 1e-10);
    CHECK(max_difference(shared.covariance(), P.bottomRightCorner<2, 2>()) < 1e-10);
    const Vector3<double> state = result.state + result.sensitivity * shared.mean();
    CHECK(max_difference(state, x.head<3>()) < 1e-10);
    CHECK(max_difference(result.covariance_with(shared.covariance()), P.topLeftCorner<3, 3>()) < 1e-10);
  }
}

TEST_CASE("With normal noise and a prior of the pose it is gauss_newton_update", "[least-squares]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const CameraProblem problem(rng, 20, 0.0);
    const PoseGaussian<double> density{near(rng, problem.truth), pose_covariance<double>(0.03, 0.3)};
    const auto expected = gauss_newton_update(density, measurements_of(problem.scene), problem.h);
    const auto prior = LeastSquaresPrior<Poses>::from_covariance(density.pose, density.covariance);
    const auto result =
        robust_least_squares<Poses>(density.pose, problem, NormalNoise<double>{}, kByNoise, &prior);
    REQUIRE(result.converged());
    REQUIRE(expected.status == UpdateStatus::kConverged);
    // Both end within 1e-3 standard deviations of the optimum; these are up to .01 m.
    CHECK(result.state.is_approx(expected.posterior.pose, 2e-5));
    CHECK(max_difference(result.covariance, expected.posterior.covariance) <
          0.01 * expected.posterior.covariance.diagonal().maxCoeff());
    CHECK(result.squared_distance == Approx(expected.nis).epsilon(1e-3));
  }
}

TEMPLATE_TEST_CASE("The covariance holds with 0, 5 and 20 % of outliers", "[least-squares][consistency]",
                   CauchyLoss<double>, StudentT<double>, Contamination<double>) {
  constexpr int kRuns = 200;
  const double share = GENERATE(0.0, 0.05, 0.2);
  double sum = 0.0;
  int trusted = 0;
  Rng rng(7);
  for (int run = 0; run < kRuns; ++run) {
    const CameraProblem problem(rng, 60, share);
    const auto result = robust_least_squares<Poses>(near(rng, problem.truth), problem, TestType{});
    if (!result.converged()) continue;
    ++trusted;
    sum += nees(result, problem.truth);
  }
  CAPTURE(share, trusted, sum / trusted);
  CHECK(trusted >= 0.99 * kRuns);
  // Mean of 200 chi-squares of six dimensions: 6 +- .49 (95 %). The covariance is itself estimated, from 180
  // residuals: the mean of e' P^-1 e is then larger by a factor of about 180 / (180 - 12).
  CHECK(sum / trusted > 5.5);
  CHECK(sum / trusted < 6.5 * 180.0 / 168.0);
}

TEST_CASE("The covariance follows errors that are larger or smaller than assumed", "[least-squares]") {
  constexpr int kRuns = 200;
  const double noise = GENERATE(0.3, 3.0);
  double sum = 0.0;
  Rng rng(8);
  for (int run = 0; run < kRuns; ++run) {
    const CameraProblem problem(rng, 60, 0.0, noise);
    const auto result = robust_least_squares<Poses>(near(rng, problem.truth), problem, CauchyLoss<double>{});
    REQUIRE(result.status != LeastSquaresStatus::kNotSettled);
    sum += nees(result, problem.truth) / kRuns;
  }
  CAPTURE(noise, sum);
  CHECK(sum > 5.3);
  CHECK(sum < 7.2);
}

TEST_CASE("One measurement, and ten thousand", "[least-squares]") {
  Rng rng(3);
  LinearProblem<3, 0> one(rng, 1);
  const LeastSquaresPrior<R3> prior =
      LeastSquaresPrior<R3>::from_covariance(Vector3<double>::Zero(), Matrix3<double>::Identity());
  const auto few = robust_least_squares<R3>(R3::Point::Zero(), one, NormalNoise<double>{}, kByNoise, &prior);
  CHECK(few.converged());
  const Matrix3<double> H =
      Matrix3<double>::Identity() + one.rows[0].J.transpose() * one.rows[0].S_inverse * one.rows[0].J;
  CHECK(max_difference(few.covariance, H.inverse()) < 1e-12);

  const CameraProblem many(rng, 10000, 0.2);
  const auto result = robust_least_squares<Poses>(near(rng, many.truth), many, StudentT<double>{});
  CHECK(result.converged());
  CHECK(nees(result, many.truth) < 22.5);  // 99.9 %
}

TEST_CASE("What is not determined is named", "[least-squares]") {
  using Status = LeastSquaresStatus;
  Rng rng(4);
  SECTION("no measurements") {
    const auto nothing = [](const Pose&, auto&) {};
    const auto result = robust_least_squares<Poses>(Pose::identity(), nothing, CauchyLoss<double>{});
    CHECK(result.status == Status::kUndetermined);
    CHECK(result.covariance.hasNaN());
  }
  SECTION("a direction that no measurement depends on") {
    LinearProblem<3, 0> problem(rng, 20);
    for (auto& row : problem.rows) row.J.col(1) = row.J.col(0);
    CHECK(robust_least_squares<R3>(R3::Point::Zero(), problem, CauchyLoss<double>{}).status ==
          Status::kUndetermined);
    const auto prior =
        LeastSquaresPrior<R3>::from_covariance(Vector3<double>::Zero(), Matrix3<double>::Identity());
    CHECK(robust_least_squares<R3>(R3::Point::Zero(), problem, CauchyLoss<double>{}, {}, &prior).converged());
  }
  SECTION("as many numbers as unknowns have no residuals to take a covariance from") {
    const LinearProblem<2, 0> problem(rng, 1);
    using R2 = VectorChart<double, 2>;
    CHECK(robust_least_squares<R2>(R2::Point::Zero(), problem, NormalNoise<double>{}).status ==
          Status::kUndetermined);
    CHECK(robust_least_squares<R2>(R2::Point::Zero(), problem, NormalNoise<double>{}, kByNoise).converged());
  }
  SECTION("what considered parameters do is known even if the covariance is not") {
    const LinearProblem<2, 1> problem(rng, 1);
    using R2 = VectorChart<double, 2>;
    const auto solve = [&](CovarianceFrom from) {
      return robust_least_squares<R2, 1>(R2::Point::Zero(), problem, NormalNoise<double>{},
                                         {.covariance = from});
    };
    const auto open = solve(CovarianceFrom::kResiduals), by_noise = solve(CovarianceFrom::kNoise);
    CHECK(open.status == Status::kUndetermined);
    REQUIRE(by_noise.converged());
    CHECK(open.sensitivity == by_noise.sensitivity);
    CHECK(open.considered.information == by_noise.considered.information);
    CHECK(open.considered.vector == by_noise.considered.vector);
    CHECK(open.sensitivity.norm() > 0.0);
  }
  SECTION("a measurement that is not finite") {
    LinearProblem<3, 0> problem(rng, 20);
    problem.rows[5].z.x() = GENERATE(std::numeric_limits<double>::quiet_NaN(), 1e308 * 10.0);
    CHECK(robust_least_squares<R3>(R3::Point::Zero(), problem, NormalNoise<double>{}).status ==
          Status::kNotFinite);
  }
  SECTION("steps that do not settle in time") {
    const CameraProblem problem(rng, 60, 0.2);
    const auto result = robust_least_squares<Poses>(near(rng, problem.truth), problem, CauchyLoss<double>{},
                                                    {.max_iterations = 2});
    CHECK(result.status == Status::kNotSettled);
  }
  SECTION("two values that explain the measurements as well as each other") {
    using R1 = VectorChart<double, 1>;
    using Number = Vector<double, 1>;
    const bool equal = GENERATE(true, false);  // as many at 6 as at -6, or half as many
    const auto two_groups = [&](const Number& x, auto& sums) {
      for (int i = 0; i < 30; ++i) {
        const bool first = equal ? i % 2 == 0 : i % 3 > 0;
        sums.add(Number((first ? -6.0 : 6.0) + 0.1 * (i % 5) - x[0]), Number(1.0), Number(1.0));
      }
    };
    const auto near_smaller = robust_least_squares<R1>(Number(5.0), two_groups, Contamination<double>{});
    if (equal) {
      CHECK(near_smaller.status == Status::kAmbiguous);
    } else {
      CHECK(near_smaller.converged());
      CHECK(near_smaller.state[0] == Approx(-5.8).margin(0.5));  // the larger group
    }
  }
  SECTION("invalid options and noise") {
    const LinearProblem<3, 0> problem(rng, 20);
    const auto with = [&](const LeastSquaresOptions<double>& options, const CauchyLoss<double>& noise) {
      return error_message(
          [&] { return robust_least_squares<R3>(R3::Point::Zero(), problem, noise, options); });
    };
    CHECK(contains(with({.max_iterations = 0}, {}), "max_iterations is not positive: 0"));
    CHECK(contains(with({.tolerance = 0.0}, {}), "tolerance is not positive: 0"));
    CHECK(contains(with({.max_increase = -1.0}, {}), "max_increase is negative: -1"));
    CHECK(contains(with({}, {.scale = 0.0}), "scale of CauchyLoss is not positive: 0"));
    CHECK(contains(error_message([] {
                     return LeastSquaresPrior<R3>::from_covariance(Vector3<double>::Zero(),
                                                                   Matrix3<double>::Zero());
                   }),
                   "covariance of the prior is not positive definite"));
  }
}

TEST_CASE("Landmarks behind the camera are outliers, and do not make a pose that sees none the best",
          "[least-squares]") {
  Rng rng(5);
  const CameraProblem problem(rng, 40, 0.0);
  Vector6<double> turned = Vector6<double>::Zero();
  turned[1] = 0.6;  // many landmarks leave the image, and some come behind the camera
  const auto result = robust_least_squares<Poses>(problem.truth.boxplus(turned), problem, StudentT<double>{});
  REQUIRE(result.converged());
  CHECK(nees(result, problem.truth) < 22.5);
}
