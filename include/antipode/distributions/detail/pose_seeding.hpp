// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <antipode/distributions/detail/tangent_moments.hpp>
#include <antipode/eigen_types.hpp>

/// Starting points for the fit of a mixture: k-means++ over poses (D. Arthur and S. Vassilvitskii,
/// "k-means++: the advantages of careful seeding", 2007).
namespace antipode::detail {

/// Squared distance of poses, rotations and translations each in units of the spread of all samples:
/// acos|q.q'|^2 / s_r^2 + |t - t'|^2 / s_t^2.
template <class Scalar>
class PoseMetric {
 public:
  explicit PoseMetric(const PoseSample<Scalar>& sample) {
    const Vector4<Scalar> q = mean_rotation<Scalar>(sample, sample.weights);
    const Scalar total = sample.weights.sum();
    const Vector3<Scalar> t = mean_translation<Scalar>(sample, sample.weights);
    Scalar rotation(0), translation(0);
    for (Eigen::Index k = 0; k < sample.size(); ++k) {
      rotation += sample.weights[k] / total * squared_angle(q, sample.rotation(k));
      translation += sample.weights[k] / total * (sample.translation(k) - t).squaredNorm();
    }
    // If all samples have the same rotation, only the translation counts, and vice versa.
    rotation_scale_ = rotation > Scalar(0) ? Scalar(1) / rotation : Scalar(0);
    translation_scale_ = translation > Scalar(0) ? Scalar(1) / translation : Scalar(0);
    translation_variance_ = translation / Scalar(3);
  }

  [[nodiscard]] Scalar operator()(const Vector4<Scalar>& q_a, const Vector3<Scalar>& t_a,
                                  const Vector4<Scalar>& q_b, const Vector3<Scalar>& t_b) const {
    return rotation_scale_ * squared_angle(q_a, q_b) + translation_scale_ * (t_a - t_b).squaredNorm();
  }

  /// Mean variance of a coordinate of the translation, over all samples.
  [[nodiscard]] Scalar translation_variance() const { return translation_variance_; }

 private:
  [[nodiscard]] static Scalar squared_angle(const Vector4<Scalar>& a, const Vector4<Scalar>& b) {
    const Scalar angle = std::acos(std::min(Scalar(1), std::abs(a.dot(b))));
    return angle * angle;
  }

  Scalar rotation_scale_, translation_scale_, translation_variance_;
};

/// Which of `count` clusters every sample belongs to. The first centre is the mean of all samples, or a
/// random one of them. Every other centre is drawn from the samples, by the squared distance from the nearest
/// centre so far (k-means++). Three iterations of k-means follow.
template <class Scalar, class Rng>
[[nodiscard]] std::vector<std::size_t> seed_clusters(const PoseSample<Scalar>& sample,
                                                     const PoseMetric<Scalar>& distance, std::size_t count,
                                                     bool start_at_mean, Rng& rng) {
  constexpr int kIterations = 3;
  const auto size = static_cast<std::size_t>(sample.size());
  std::vector<Vector4<Scalar>> rotations;
  std::vector<Vector3<Scalar>> translations;
  std::vector<std::size_t> nearest(size, 0);
  std::vector<Scalar> squares(size, Scalar(1));
  const auto assign = [&](std::size_t k, std::size_t cluster) {
    const auto column = static_cast<Eigen::Index>(k);
    const Scalar d = distance(rotations[cluster], translations[cluster], sample.rotation(column),
                              sample.translation(column));
    if (cluster == 0 || d < squares[k]) {
      squares[k] = d;
      nearest[k] = cluster;
    }
  };
  for (std::size_t cluster = 0; cluster < count; ++cluster) {
    if (cluster == 0 && start_at_mean) {
      rotations.push_back(mean_rotation<Scalar>(sample, sample.weights));
      translations.push_back(mean_translation<Scalar>(sample, sample.weights));
    } else {
      Scalar remaining(0);
      for (std::size_t k = 0; k < size; ++k) remaining += squares[k] * sample.weights[static_cast<int>(k)];
      remaining *= std::uniform_real_distribution<Scalar>()(rng);
      std::size_t chosen = 0;
      while (chosen + 1 < size) {
        remaining -= squares[chosen] * sample.weights[static_cast<int>(chosen)];
        if (remaining < Scalar(0)) break;
        ++chosen;
      }
      rotations.push_back(sample.rotation(static_cast<Eigen::Index>(chosen)));
      translations.push_back(sample.translation(static_cast<Eigen::Index>(chosen)));
    }
    for (std::size_t k = 0; k < size; ++k) assign(k, cluster);
  }

  Vector<Scalar, Eigen::Dynamic> weights(sample.size());
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    for (std::size_t cluster = 0; cluster < count; ++cluster) {
      for (std::size_t k = 0; k < size; ++k) {
        const auto column = static_cast<Eigen::Index>(k);
        weights[column] = nearest[k] == cluster ? sample.weights[column] : Scalar(0);
      }
      if (!(weights.sum() > Scalar(0))) continue;
      rotations[cluster] = mean_rotation<Scalar>(sample, weights);
      translations[cluster] = mean_translation<Scalar>(sample, weights);
    }
    for (std::size_t cluster = 0; cluster < count; ++cluster) {
      for (std::size_t k = 0; k < size; ++k) assign(k, cluster);
    }
  }
  return nearest;
}

}  // namespace antipode::detail
