// SPDX-License-Identifier: MIT
#pragma once

/// @file
/// Everything that needs only Eigen. The adapters in antipode/ceres, antipode/opencv and the checks in
/// antipode/testing are included one by one.

/// @namespace antipode
/// Estimation on SE(3): poses, their densities, sigma points and Bayes updates.

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/cubature/point_sets.hpp>
#include <antipode/distributions/bingham.hpp>
#include <antipode/distributions/bingham_directions.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/bingham_normalizer.hpp>
#include <antipode/distributions/component_merging.hpp>
#include <antipode/distributions/covariance_conventions.hpp>
#include <antipode/distributions/density.hpp>
#include <antipode/distributions/gaussian.hpp>
#include <antipode/distributions/gaussian_information.hpp>
#include <antipode/distributions/keyframe_change.hpp>
#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/mixture_fit.hpp>
#include <antipode/distributions/mixture_queries.hpp>
#include <antipode/distributions/mixture_reduction.hpp>
#include <antipode/distributions/pose_algebra.hpp>
#include <antipode/distributions/pose_box.hpp>
#include <antipode/distributions/pose_charts.hpp>
#include <antipode/distributions/pose_fusion.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/pose_gaussian_fit.hpp>
#include <antipode/distributions/pose_gaussian_queries.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/distributions/projected_gaussian_conversions.hpp>
#include <antipode/distributions/projected_gaussian_operations.hpp>
#include <antipode/distributions/projected_orientation.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/angle_measurements.hpp>
#include <antipode/filters/gauss_newton_update.hpp>
#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/log_likelihood.hpp>
#include <antipode/filters/marginal_update.hpp>
#include <antipode/filters/mixture_filter.hpp>
#include <antipode/filters/noisy_measurement.hpp>
#include <antipode/filters/pose_filter.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/predict.hpp>
#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/robust_least_squares.hpp>
#include <antipode/filters/robust_likelihood.hpp>
#include <antipode/filters/robust_noise.hpp>
#include <antipode/filters/smoothing_filter.hpp>
#include <antipode/filters/unscented_update.hpp>
#include <antipode/filters/update_status.hpp>
#include <antipode/filters/weighted_sums.hpp>
#include <antipode/geometry/angles.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/extended_pose.hpp>
#include <antipode/geometry/interpolation.hpp>
#include <antipode/geometry/jacobians.hpp>
#include <antipode/geometry/manifold.hpp>
#include <antipode/geometry/quaternion.hpp>
#include <antipode/geometry/rotation_integrals.hpp>
#include <antipode/sampling/bingham_rules.hpp>
#include <antipode/sampling/mixture_moments.hpp>
#include <antipode/sampling/pose_rules.hpp>
#include <antipode/sampling/sample_gaussian.hpp>
#include <antipode/sampling/sample_projected_gaussian.hpp>
#include <antipode/sampling/sigma_point_rule.hpp>
#include <antipode/sensors/inertial_measurement_unit.hpp>
#include <antipode/sensors/inertial_propagation.hpp>
#include <antipode/sensors/inverse_depth_landmark.hpp>
#include <antipode/sensors/stereo_camera.hpp>
#include <antipode/weighted_samples.hpp>
