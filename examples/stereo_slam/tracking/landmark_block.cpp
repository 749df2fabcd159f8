// SPDX-License-Identifier: MIT
// The innermost loop of the pose update. It is compiled for registers of two doubles, which every processor
// of 64 bits has, and on x86 for registers of four as well; the processor decides at run time. Every lane is
// summed apart, so that both give the same bits.
#include "stereo_slam/tracking/landmark_block.hpp"

namespace stereo_slam {
namespace {

/// `Width` doubles in one register: an extension of GCC and Clang.
template <std::size_t Width>
struct Register {
  using Type [[gnu::vector_size(Width * sizeof(double)), gnu::may_alias]] = double;
};

/// ErrorSums of the landmarks in some lanes.
template <std::size_t Width>
struct LaneSums {
  typename Register<Width>::Type squared_distance = {};
  typename Register<Width>::Type w[6] = {};
};

/// Adds the errors of the landmarks in the lanes from `Width * part` on.
template <std::size_t Width, bool Correlated>
[[gnu::always_inline]] inline void add_errors(const LandmarkBlock& block, std::size_t part,
                                              const CameraAtPose& view, const Vector6<double>& y,
                                              LaneSums<Width>& sums) {
  using V = typename Register<Width>::Type;
  const auto lanes = [part](const LandmarkBlock::Lanes& all) -> const V& {
    return reinterpret_cast<const V*>(all.data())[part];
  };
  const auto& [R, t, camera, cap] = view;
  const V &p_x = lanes(block.point[0]), &p_y = lanes(block.point[1]), &p_z = lanes(block.point[2]);
  const V& weight = lanes(block.weight);
  const V h_x = R(0, 0) * p_x + R(0, 1) * p_y + R(0, 2) * p_z + t[0] * weight;
  const V h_y = R(1, 0) * p_x + R(1, 1) * p_y + R(1, 2) * p_z + t[1] * weight;
  const V h_z = R(2, 0) * p_x + R(2, 1) * p_y + R(2, 2) * p_z + t[2] * weight;
  const V inverse = 1.0 / h_z;
  const V du = lanes(block.measurement[0]) - (camera.fx * h_x * inverse + camera.cx);
  const V dv = lanes(block.measurement[1]) - (camera.fy * h_y * inverse + camera.cy);
  const V dd = lanes(block.measurement[2]) - (camera.fx * camera.baseline_m) * weight * inverse;
  const auto& U = block.whitening;
  const auto& UV = block.correlation;
  V a = lanes(U[0]) * du + lanes(U[1]) * dv + lanes(U[2]) * dd;
  V b = lanes(U[3]) * dv + lanes(U[4]) * dd;
  V c = lanes(U[5]) * dd;
  if constexpr (Correlated) {
    for (std::size_t k = 0; k < 6; ++k) {
      const double y_k = y[static_cast<Eigen::Index>(k)];
      a -= lanes(UV[k]) * y_k;
      b -= lanes(UV[6 + k]) * y_k;
      c -= lanes(UV[12 + k]) * y_k;
    }
  }
  const V distance2 = a * a + b * b + c * c;
  const auto counts = (h_z > StereoCamera::kMinDepth_m * weight) & (distance2 < cap);
  sums.squared_distance += counts ? distance2 : lanes(block.cap);
  if constexpr (Correlated) {
    const V zero = {};
    a = counts ? a : zero;
    b = counts ? b : zero;
    c = counts ? c : zero;
    for (std::size_t k = 0; k < 6; ++k) {
      sums.w[k] += lanes(UV[k]) * a + lanes(UV[6 + k]) * b + lanes(UV[12 + k]) * c;
    }
  }
}

template <std::size_t Width, bool Correlated>
[[gnu::always_inline]] inline ErrorSums sum_errors(std::span<const LandmarkBlock> blocks,
                                                   const CameraAtPose& view, const Vector6<double>& y) {
  constexpr std::size_t kParts = LandmarkBlock::kLanes / Width;
  LaneSums<Width> parts[kParts];
  for (std::size_t part = 0; part < kParts; ++part) {
    for (const auto& block : blocks) add_errors<Width, Correlated>(block, part, view, y, parts[part]);
  }
  const auto total = [&parts](auto lanes_of) {
    const auto lane = [&](std::size_t i) { return lanes_of(parts[i / Width])[i % Width]; };
    return (lane(0) + lane(2)) + (lane(1) + lane(3));
  };
  ErrorSums sums;
  using Part = LaneSums<Width>;
  sums.squared_distance = total([](const Part& part) -> auto& { return part.squared_distance; });
  for (std::size_t k = 0; Correlated && k < 6; ++k) {
    sums.w[static_cast<Eigen::Index>(k)] = total([k](const Part& part) -> auto& { return part.w[k]; });
  }
  return sums;
}

#ifdef __x86_64__
template <bool Correlated>
[[gnu::target("avx2")]] ErrorSums sum_errors_avx2(std::span<const LandmarkBlock> blocks,
                                                  const CameraAtPose& view, const Vector6<double>& y) {
  return sum_errors<4, Correlated>(blocks, view, y);
}
#endif

template <bool Correlated>
[[nodiscard]] ErrorSums sum_errors_here(std::span<const LandmarkBlock> blocks, const CameraAtPose& view,
                                        const Vector6<double>& y) {
#ifdef __x86_64__
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  if (has_avx2) return sum_errors_avx2<Correlated>(blocks, view, y);
#endif
  return sum_errors<2, Correlated>(blocks, view, y);
}

}  // namespace

ErrorSums sum_independent_errors(std::span<const LandmarkBlock> blocks, const CameraAtPose& view) {
  return sum_errors_here<false>(blocks, view, Vector6<double>::Zero());
}

ErrorSums sum_correlated_errors(std::span<const LandmarkBlock> blocks, const CameraAtPose& view,
                                const Vector6<double>& y) {
  return sum_errors_here<true>(blocks, view, y);
}

}  // namespace stereo_slam
