// SPDX-License-Identifier: MIT
#include <cmath>
#include <string>

#include <antipode/filters/predict.hpp>

#include "distributions/random_densities.hpp"
#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// The density matched to all pairs, each of them formed and stored.
template <class Rule>
[[nodiscard]] BinghamGaussian<double> brute_force(const BinghamGaussian<double>& state,
                                                  const DualQuaternion<double>& motion,
                                                  const BinghamGaussian<double>& noise, const Rule& rule,
                                                  const MomentMatchOptions<double>& options) {
  const auto x = sample(rule, state);
  const auto v = sample(rule, noise);
  Eigen::Matrix<double, 8, Eigen::Dynamic> poses(8, Rule::kCount * Rule::kCount);
  Eigen::VectorXd weights(Rule::kCount * Rule::kCount);
  int pair = 0;
  for (int i = 0; i < Rule::kCount; ++i) {
    for (int j = 0; j < Rule::kCount; ++j) {
      using Pose = DualQuaternion<double>;
      const Pose moved = Pose::unchecked(x.points.col(i)) * motion * Pose::unchecked(v.points.col(j));
      poses.col(pair) = (pair % 3 == 0 ? -1.0 : 1.0) * moved.coeffs();
      weights[pair++] = x.weights[i] * v.weights[j];
    }
  }
  return moment_match(poses, weights, options);
}

/// Compares what does not depend on the signs of the axes.
void check_same(const BinghamGaussian<double>& a, const BinghamGaussian<double>& b, double tolerance) {
  CHECK(max_difference(a.orientation().scatter(), b.orientation().scatter()) <= tolerance);
  CHECK(max_difference(a.mean_translation(), b.mean_translation()) <= tolerance);
  CHECK(max_difference(a.conditional_covariance(), b.conditional_covariance()) <= tolerance);
  CHECK(max_difference(a.covariance(), b.covariance()) <= tolerance);
}

}  // namespace

TEST_CASE("Prediction has the moments of all pairs of samples", "[predict]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    Rng rng(seed);
    // From uniform to concentrated; distinct moments, or the axes would be arbitrary.
    const auto state = random_bingham_gaussian<double>(rng, 0.0, 3.0);
    const auto noise = random_bingham_gaussian<double>(rng, 1.0, 3.0);
    const auto motion = random_pose<double>(rng);
    for (bool keep_coupling : {true, false}) {
      CAPTURE(seed, keep_coupling);
      const MomentMatchOptions<double> options{.keep_coupling = keep_coupling};
      check_same(predict(state, motion, noise, JointPoseRule{}, options),
                 brute_force(state, motion, noise, JointPoseRule{}, options), 1e-9);
      check_same(predict(state, motion, noise, PaperPoseRule{}, options),
                 brute_force(state, motion, noise, PaperPoseRule{}, options), 1e-9);
    }
  }
}

TEST_CASE("Sigma points and closed form agree for concentrated states", "[predict]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const double sigma = 1e-3;
    const PoseGaussian<double> state{random_pose<double>(rng),
                                     sigma * sigma * random_covariance<double, 6>(rng)};
    const PoseGaussian<double> noise{DualQuaternion<double>::identity(),
                                     sigma * sigma * random_covariance<double, 6>(rng)};
    const auto motion = random_pose<double>(rng);
    const auto closed = predict_closed_form(state, motion, noise);
    const auto sampled =
        to_pose_gaussian(predict(to_bingham_gaussian(state), motion, to_bingham_gaussian(noise),
                                 JointPoseRule{}, {.min_eigenvalue = 1e-12}));
    // Terms of the second order: sigma^2 times the lever arm in the mean, sigma^2 relative in the covariance.
    CHECK(sampled.pose.boxminus(closed.pose).norm() <= 10 * sigma * sigma);
    CHECK((sampled.covariance - closed.covariance).norm() <= 100 * sigma * sigma * closed.covariance.norm());
  }
}

TEMPLATE_TEST_CASE("The closed form moves perturbations through the motion", "[predict][law]", float,
                   double) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_pose<TestType>(rng), u = random_pose<TestType>(rng),
               v = random_pose<TestType>(rng, 0.1);
    const Vector6<TestType> xi = random_twist<TestType>(rng, 0.5, 1.0);
    // The covariance of a perturbation in the direction xi only.
    const auto predicted =
        predict_closed_form<TestType>({x, xi * xi.transpose()}, u, {v, Matrix6<TestType>::Zero()});
    const Vector6<TestType> moved = (x.boxplus(xi) * u * v).boxminus(x * u * v);
    const double tolerance = 2000 * kEpsilon<TestType> * (1.0 + static_cast<double>(moved.squaredNorm()));
    CHECK(max_difference(predicted.covariance, moved * moved.transpose()) <= tolerance);
    CHECK(predicted.pose.is_approx(x * u * v, TestType(100 * kEpsilon<TestType>)));
    CHECK(predicted.covariance == predicted.covariance.transpose());
  }
}

TEST_CASE("A long motion couples translation and orientation", "[predict]") {
  const PoseGaussian<double> state{{}, pose_covariance<double>(0.01, 0.001)};
  const PoseGaussian<double> noise{{}, pose_covariance<double>(1e-5, 1e-5)};
  const auto motion = DualQuaternion<double>::from_rotation_translation(Vector4<double>(1.0, 0.0, 0.0, 0.0),
                                                                        Vector3<double>(0.0, 0.0, 10.0));
  const auto run = [&](bool keep_coupling) {
    return predict(to_bingham_gaussian(state), motion, to_bingham_gaussian(noise), RichPoseRule{},
                   {.keep_coupling = keep_coupling, .min_eigenvalue = 1e-12});
  };
  const Matrix6<double> P = run(true).covariance();
  // x moves by 10 m times the rotation about y, y by minus 10 m times that about x; 1e-4 is the second order.
  CHECK(P(1, 3) == Approx(10.0 * 1e-4).epsilon(1e-3));
  CHECK(P(0, 4) == Approx(-10.0 * 1e-4).epsilon(1e-3));
  CHECK(P(3, 3) == Approx(100.0 * 1e-4 + 1e-6).epsilon(1e-3));
  const auto independent = run(false);
  CHECK(independent.coupling().isZero());
  CHECK(independent.translation_covariance()(0, 0) == Approx(P(3, 3)).epsilon(1e-3));
}

TEST_CASE("Exchanging q and -q of the state, the motion or the noise predicts the same", "[predict][law]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto state = random_bingham_gaussian<double>(rng, 1.0, 3.0);
    const auto noise = random_bingham_gaussian<double>(rng, 2.0, 4.0);
    const auto motion = random_pose<double>(rng);
    const auto expected = predict(state, motion, noise, JointPoseRule{});
    check_same(predict(antipode_of(state), motion, noise, JointPoseRule{}), expected, 1e-10);
    check_same(predict(state, antipode_of(motion), noise, JointPoseRule{}), expected, 1e-10);
    check_same(predict(state, motion, antipode_of(noise), JointPoseRule{}), expected, 1e-10);
  }
}

TEST_CASE("Prediction far from the origin is as accurate as near it", "[predict][law]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const PoseGaussian<double> local{random_pose<double>(rng), 1e-6 * random_covariance<double, 6>(rng, 0.1)};
    const auto state = to_bingham_gaussian(local);
    const auto noise =
        to_bingham_gaussian(PoseGaussian<double>{{}, 1e-6 * random_covariance<double, 6>(rng, 0.1)});
    const auto motion = random_pose<double>(rng);
    const auto far = random_pose<double>(rng, 1e4);
    const auto expected = compose(far, predict(state, motion, noise, JointPoseRule{}));
    const auto predicted = predict(compose(far, state), motion, noise, JointPoseRule{});
    // 1e4 m are known to 2e-12 m, a variance of (1e-3 m)^2 thus to some 1e-8 of it.
    CHECK((predicted.covariance() - expected.covariance()).norm() <= 1e-7 * expected.covariance().norm());
    CHECK((predicted.mean_translation() - expected.mean_translation()).norm() <= 1e-10);
  }
}

TEST_CASE("A certain state and no noise stay certain", "[predict]") {
  Rng rng(1);
  const auto certain = [](const DualQuaternion<double>& pose) {
    return to_bingham_gaussian(PoseGaussian<double>{pose, Matrix6<double>::Zero()});
  };
  const auto x = random_pose<double>(rng), u = random_pose<double>(rng);
  const auto predicted = predict(certain(x), u, certain({}), JointPoseRule{}, {.min_eigenvalue = 1e-14});
  CHECK(predicted.pose().is_approx(x * u, 1e-10));
  CHECK(predicted.covariance().norm() <= 1e-12);
}

TEST_CASE("A prediction with one triangle of a covariance is refused with its value", "[predict][error]") {
  using Pose = DualQuaternion<double>;
  using Split = SplitPoseGaussian<double>;
  const Matrix6<double> full = Matrix6<double>::Identity();
  const std::string of_pose = "pose covariance is not finite or not symmetric: [";
  const std::string of_noise = "covariance of the noise is not finite or not symmetric: [";
  const auto stay = [](const Pose& x) { return x; };
  const auto refused = [](const auto& f, const std::string& why) {
    const auto message = error_message(f);
    return contains(message, why) && contains(message, "0.25");
  };
  for (const bool upper : {false, true}) {
    CAPTURE(upper);
    Matrix6<double> triangle = full;
    triangle(upper ? 1 : 4, upper ? 4 : 1) = 0.25;
    const PoseGaussian<double> state{Pose(), full}, bad{Pose(), triangle};
    const Split split{Pose(), full}, bad_split{Pose(), triangle};
    CHECK(refused([&] { return predict_closed_form(bad, Pose(), state); }, of_pose));
    CHECK(refused([&] { return predict_closed_form(state, Pose(), bad); }, of_pose));
    CHECK(refused([&] { return predict_closed_form(bad_split, Pose(), state); }, of_pose));
    CHECK(refused([&] { return predict_closed_form(split, Pose(), bad); }, of_pose));
    CHECK(refused([&] { return predict_closed_form(bad, stay, full, full); }, of_pose));
    CHECK(refused([&] { return predict_closed_form(state, stay, full, triangle); }, of_noise));
    CHECK(refused([&] { return predict(bad, stay, full); }, of_pose));
    CHECK(refused([&] { return predict(state, stay, triangle); }, of_noise));
  }
}
