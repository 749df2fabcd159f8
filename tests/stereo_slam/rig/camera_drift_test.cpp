// SPDX-License-Identifier: MIT
// The recursive estimate of drifting errors is that of one dense problem.
#include "stereo_slam/rig/camera_drift.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Dense>

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr int kErrors = ErrorTerms::kAll, kBoth = ErrorTerms::kBoth;
constexpr int kDisplacement = ImageDisplacement::kTerms;
constexpr std::size_t kMotions = 7;

/// Motions that each tell a part, with a shift and a diffusion after the third of them.
struct Drive {
  ErrorTerms::ByDisplacement by_displacement = DisplacementTerms(test::kitti_camera()).disparity;
  ErrorTerms::Evidence begin;
  std::vector<ErrorTerms::EvidenceOfBoth> motions;
  ErrorChange change{.motions = 3};

  explicit Drive(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    const auto fill = [&](auto matrix) {
      return decltype(matrix)(matrix.unaryExpr([&](double) { return normal(random); }));
    };
    begin.information.diagonal().setConstant(4.0);
    for (std::size_t i = 0; i < kMotions; ++i) {
      const auto terms = fill(Eigen::Matrix<double, 9, kBoth>::Zero().eval());
      motions.push_back(
          {terms.transpose() * terms, terms.transpose() * fill(Eigen::Matrix<double, 9, 1>::Zero().eval())});
    }
    change.shift = fill(ErrorTerms::Coefficients::Zero().eval());
    const auto root = fill(ErrorTerms::Covariance::Zero().eval());
    change.covariance = 0.1 * root * root.transpose();
  }
};

/// Errors before the first motion, its displacement, the displacement of the second motion, and so on, and
/// the unknown part of the change, as one vector.
struct Dense {
  static constexpr Eigen::Index kAll = kErrors * 2 + kDisplacement * static_cast<Eigen::Index>(kMotions);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(kAll, kAll), prior = information;
  Eigen::VectorXd vector = Eigen::VectorXd::Zero(kAll);
  double constant = 0.0;                // log of the density of the measurements at zero
  std::vector<Eigen::MatrixXd> during;  // (errors, displacement) of each motion
  std::vector<Eigen::VectorXd> known_part;

  Dense(const Drive& drive, double sigma_px) {
    Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(kErrors, kAll);
    Eigen::VectorXd shift = Eigen::VectorXd::Zero(kErrors);
    errors.leftCols(kErrors).setIdentity();
    prior.topLeftCorner(kErrors, kErrors) = drive.begin.information;
    prior.bottomRightCorner(kErrors, kErrors) = drive.change.covariance.inverse();
    for (std::size_t i = 0; i < kMotions; ++i) {
      const Eigen::Index at = kErrors + kDisplacement * static_cast<Eigen::Index>(i);
      prior.block(at, at, kDisplacement, kDisplacement).diagonal().setConstant(1.0 / (sigma_px * sigma_px));
      Eigen::MatrixXd both = Eigen::MatrixXd::Zero(kBoth, kAll);
      both.topRows(kErrors) = errors;
      both.block(kErrors, at, kDisplacement, kDisplacement).setIdentity();
      Eigen::VectorXd known = Eigen::VectorXd::Zero(kBoth);
      known.head(kErrors) = shift;
      const auto& motion = drive.motions[i];
      information += both.transpose() * motion.information * both;
      vector += both.transpose() * (motion.vector - motion.information * known);
      constant += motion.vector.dot(known) - 0.5 * known.dot(motion.information * known);
      during.push_back(both);
      known_part.push_back(known);
      errors.middleCols(at, kDisplacement) += drive.by_displacement;
      if (i + 1 != drive.change.motions) continue;
      errors.rightCols(kErrors).setIdentity();
      shift += drive.change.shift;
    }
    information += prior;
  }
};

TEST_CASE("Smoothed errors are those of a dense solution", "[stereo_slam][rectification]") {
  const double sigma_px = GENERATE(0.03, 0.5);
  std::mt19937_64 random(3);
  const Drive drive(random);
  const Dense dense(drive, sigma_px);
  const std::vector<float> sigmas_px(kMotions, static_cast<float>(sigma_px));
  const auto smoothed = smoothed_errors(drive.motions, sigmas_px, std::vector{drive.change},
                                        drive.by_displacement, drive.begin, {});
  REQUIRE(smoothed.size() == kMotions);
  const Eigen::MatrixXd covariance = dense.information.inverse();
  const Eigen::VectorXd mean = covariance * dense.vector;
  for (std::size_t i = 0; i < kMotions; ++i) {
    CAPTURE(i);
    CHECK((smoothed[i].mean - dense.during[i] * mean - dense.known_part[i]).norm() < 1e-6);
    const Eigen::MatrixXd expected = dense.during[i] * covariance * dense.during[i].transpose();
    CHECK((smoothed[i].covariance - expected).norm() < 1e-6 * expected.norm());
  }
}

TEST_CASE("The likelihood of a hypothesis is that of a dense solution", "[stereo_slam][rectification]") {
  const double sigma_px = GENERATE(0.03, 0.5);
  std::mt19937_64 random(4);
  const Drive drive(random);
  DriftHypothesis hypothesis(sigma_px, drive.by_displacement, drive.begin);
  for (std::size_t i = 0; i < kMotions; ++i) {
    hypothesis.add(drive.motions[i], hypothesis.log_likelihood_of(drive.motions[i], hypothesis.everything()));
    if (i + 1 == drive.change.motions) hypothesis.change(drive.change);
  }
  const Dense dense(drive, sigma_px);
  const auto log_determinant = [](const Eigen::MatrixXd& matrix) {
    return 2.0 * Eigen::MatrixXd(matrix.llt().matrixL()).diagonal().array().log().sum();
  };
  const double expected = dense.constant +
                          0.5 * dense.vector.dot(dense.information.ldlt().solve(dense.vector)) +
                          0.5 * (log_determinant(dense.prior) - log_determinant(dense.information));
  CHECK(hypothesis.log_likelihood() == Approx(expected).epsilon(1e-9));
}

TEST_CASE("Errors that never changed are the last estimate throughout", "[stereo_slam][rectification]") {
  std::mt19937_64 random(5);
  const Drive drive(random);
  DriftHypothesis rigid(0.0, drive.by_displacement, drive.begin);
  for (const auto& motion : drive.motions) rigid.add(motion, 0.0);
  const auto& end = rigid.everything();
  const ErrorChange forgets{
      .motions = 2, .covariance = ErrorTerms::Covariance::Identity(), .only_forgets = true};
  const auto smoothed = smoothed_errors(drive.motions, rigid.sigmas_px(), std::vector{forgets},
                                        drive.by_displacement, drive.begin, end);
  for (const ErrorsDuring& errors : smoothed) {
    CHECK(errors.coefficients() == end.mean());
    CHECK(errors.displacement().isZero(0.0));
    CHECK(errors.covariance.topLeftCorner<kErrors, kErrors>() == end.covariance());
  }
  CHECK(smoothed_errors({}, {}, {}, drive.by_displacement, drive.begin, end).empty());
}

TEST_CASE("A refuted hypothesis goes on from the likelier one", "[stereo_slam][rectification]") {
  std::mt19937_64 random(6);
  const Drive drive(random);
  DriftHypothesis rigid(0.0, drive.by_displacement, drive.begin);
  DriftHypothesis drifting(0.1, drive.by_displacement, drive.begin);
  for (const auto& motion : drive.motions) {
    rigid.add(motion, -1.0);
    drifting.add(motion, -0.5);
  }
  rigid.continue_from(drifting, 10.0);
  CHECK(rigid.sigma_px() == 0.0);
  CHECK(rigid.log_likelihood() == drifting.log_likelihood() - 10.0);
  CHECK(rigid.everything().mean() == drifting.everything().mean());
  CHECK(rigid.sigmas_px() == drifting.sigmas_px());
  rigid.add(drive.motions[0], 0.0);
  CHECK(rigid.sigmas_px().back() == 0.0F);
  CHECK(rigid.spread_px2() == drifting.spread_px2());
}

TEST_CASE("A likelihood that could not be computed refutes its hypothesis", "[stereo_slam][rectification]") {
  std::mt19937_64 random(7);
  const Drive drive(random);
  DriftHypothesis hypothesis(0.1, drive.by_displacement, drive.begin);
  const ErrorTerms::Evidence singular;
  const double unknown = hypothesis.log_likelihood_of(drive.motions[0], singular);
  CHECK_FALSE(std::isfinite(unknown));
  hypothesis.add(drive.motions[0], unknown);
  CHECK(std::isfinite(hypothesis.log_likelihood()));
  CHECK(hypothesis.log_likelihood() < -100.0);
}

}  // namespace
}  // namespace stereo_slam
