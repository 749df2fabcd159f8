// SPDX-License-Identifier: MIT
#include <limits>

#include <opencv2/calib3d.hpp>

#include <antipode/opencv/pose.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

constexpr unsigned kSeed = 8;
constexpr int kTrials = 100;

TEMPLATE_TEST_CASE("Conversion to OpenCV's R and t, rvec and tvec, dual quaternion and back is exact",
                   "[opencv]", float, double) {
  using Pose = DualQuaternion<TestType>;
  Rng rng(kSeed);
  CAPTURE(kSeed);
  const auto tolerance = static_cast<TestType>(64 * kEpsilon<TestType>);
  for (int trial = 0; trial < kTrials; ++trial) {
    const Pose x = random_pose<TestType>(rng);
    const cv::Mat R(rotation_to_cv(x)), rvec(rotation_vector_to_cv(x)), t(translation_to_cv(x));
    CHECK(pose_from_cv<TestType>(R, t).is_approx(x, tolerance));
    CHECK(pose_from_cv<TestType>(rvec, t).is_approx(x, tolerance));
    CHECK(pose_from_cv<TestType>(rvec.t(), t.t()).is_approx(x, tolerance));
    CHECK(pose_from_cv(to_cv(x)).is_approx(x, tolerance));

    cv::Mat rodrigues;
    cv::Rodrigues(rvec, rodrigues);
    CHECK(cv::norm(rodrigues, R, cv::NORM_INF) <= 64 * kEpsilon<TestType>);
  }
}

TEST_CASE("OpenCV's dual quaternion means the same pose", "[opencv]") {
  Rng rng(kSeed);
  CAPTURE(kSeed);
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto x = random_pose<double>(rng), y = random_pose<double>(rng);
    const cv::Affine3d affine = to_cv(x).toAffine3(cv::QUAT_ASSUME_UNIT);
    CHECK(cv::norm(affine.translation(), translation_to_cv(x), cv::NORM_INF) <= 1e-14);
    CHECK(cv::norm(affine.rotation(), rotation_to_cv(x), cv::NORM_INF) <= 1e-14);
    CHECK(pose_from_cv(to_cv(x) * to_cv(y)).is_approx(x * y, 1e-14));
  }
}

TEST_CASE("Single-precision matrices make double-precision poses", "[opencv]") {
  Rng rng(kSeed);
  const auto x = random_pose<double>(rng);
  cv::Mat R, t;
  cv::Mat(rotation_to_cv(x)).convertTo(R, CV_32F);
  cv::Mat(translation_to_cv(x)).convertTo(t, CV_32F);
  CHECK(pose_from_cv(R, t).is_approx(x, 4 * kEpsilon<float>));
  const cv::Mat block = cv::Mat::eye(4, 4, CV_64F);  // not continuous in memory
  CHECK(pose_from_cv(block(cv::Rect(0, 0, 3, 3)), block(cv::Rect(3, 0, 1, 3)))
            .is_approx(DualQuaternion<double>(), 0));
}

TEST_CASE("Invalid matrices are refused with their size or value", "[opencv][error]") {
  const cv::Mat R = cv::Mat::eye(3, 3, CV_64F), t = cv::Mat::zeros(3, 1, CV_64F);
  CHECK(error_message([&] { return pose_from_cv(cv::Mat(), t); }) ==
        "rotation has the wrong size or several channels: 0 x 0 x 1");
  CHECK(error_message([&] { return pose_from_cv(R, cv::Mat::zeros(4, 1, CV_64F)); }) ==
        "translation has the wrong size or several channels: 4 x 1 x 1");
  CHECK_THROWS_AS(pose_from_cv(cv::Mat::eye(3, 3, CV_64FC2), t), std::invalid_argument);
  CHECK_THROWS_AS(pose_from_cv(2 * R, t), std::invalid_argument);
  CHECK_THROWS_AS(pose_from_cv(R, t + std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
  CHECK_THROWS_AS(pose_from_cv(cv::DualQuatd(2, 0, 0, 0, 0, 0, 0, 0)), std::invalid_argument);
}

}  // namespace
}  // namespace antipode::test
