// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/slanted_template.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>

#include "stereo_slam/frontend/bilinear.hpp"

namespace stereo_slam {
namespace {

// Everything here is inlined into a function for AVX2 and into one for all processors. Registers are passed
// by reference: by value they would be passed in different ways.
using Eight = SlantedTemplate::Eight;
using Pixels = SlantedTemplate::Pixels;
using Content = SlantedTemplate::Content;
using EightInts [[gnu::vector_size(8 * sizeof(std::int32_t))]] = std::int32_t;

constexpr int kRadius = SlantedTemplate::kRadius_px;
constexpr std::size_t kRows = SlantedTemplate::kSide_px;
constexpr auto kCount = static_cast<float>(kRows * kRows);
constexpr auto kLastOffset = static_cast<float>(kRadius);
constexpr Eight kOffsets{-4.0F, -3.0F, -2.0F, -1.0F, 0.0F, 1.0F, 2.0F, 3.0F};
constexpr Eight kOnlyFirst{1.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F};
static_assert(kRows == 9, "a row is eight numbers and one more");

[[gnu::always_inline]] inline float sum_of(const Eight& v) {
  return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

[[gnu::always_inline]] inline float product(const Pixels& a, const Pixels& b) {
  Eight sum = a[0] * b[0];
  for (std::size_t i = 1; i < a.size(); ++i) sum += a[i] * b[i];
  return sum_of(sum);
}

[[gnu::always_inline]] inline float sum_of(const Pixels& a) {
  Eight sum = a[0];
  for (std::size_t i = 1; i < a.size(); ++i) sum += a[i];
  return sum_of(sum);
}

[[gnu::always_inline]] inline void subtract(float number, Pixels& pixels) {
  for (std::size_t i = 0; i + 1 < pixels.size(); ++i) pixels[i] -= number;
  pixels.back() -= number * kOnlyFirst;
}

/// The eight numbers from `first` on, as the pixels of a row, and the one after them as the row's last pixel.
[[gnu::always_inline]] inline void set_row(std::size_t row, const Eight& first, float last, Pixels& pixels) {
  pixels[row] = first;
  pixels[kRows + row / 8][row % 8] = last;
}

[[gnu::always_inline]] inline void load(const float* numbers, Eight& eight) {
  std::memcpy(&eight, numbers, sizeof eight);
}

[[gnu::always_inline]] inline void load_grey(const std::uint8_t* pixels, Eight& eight) {
  const EightFloats grey(pixels);
  eight = __builtin_shufflevector(grey.first, grey.last, 0, 1, 2, 3, 4, 5, 6, 7);
}

/// Interpolated grey values at the positions `u` of the row that `line` points to, `down` of the way to the
/// row below. The positions are at equal distances.
[[gnu::always_inline]] inline void sample_eight(const std::uint8_t* line, std::size_t step, const Eight& u,
                                                float down, Eight& result) {
  constexpr EightInts kConsecutive{0, 1, 2, 3, 4, 5, 6, 7};
  EightInts column = __builtin_convertvector(u, EightInts);
  Eight upper_left, upper_right, lower_left, lower_right;
  if (column[7] - column[0] == 7) {
    column = column[0] + kConsecutive;
    const std::uint8_t* upper = line + column[0];
    load_grey(upper, upper_left);
    load_grey(upper + 1, upper_right);
    load_grey(upper + step, lower_left);
    load_grey(upper + step + 1, lower_right);
  } else {
    for (int i = 0; i < 8; ++i) {
      const std::uint8_t* upper = line + column[i];
      upper_left[i] = static_cast<float>(upper[0]);
      upper_right[i] = static_cast<float>(upper[1]);
      lower_left[i] = static_cast<float>(upper[step]);
      lower_right[i] = static_cast<float>(upper[step + 1]);
    }
  }
  const Eight right = u - __builtin_convertvector(column, Eight);
  const Eight top = upper_left + right * (upper_right - upper_left);
  const Eight bottom = lower_left + right * (lower_right - lower_left);
  result = top + down * (bottom - top);
}

/// The window of the right image with this centre and slope of the disparity.
[[gnu::always_inline]] inline void sample_slanted(const cv::Mat& image, const Eigen::Vector2f& centre,
                                                  const Eigen::Vector2f& slope, Pixels& pixels) {
  pixels.back() = Eight{};
  for (std::size_t row = 0; row < kRows; ++row) {
    const auto y = static_cast<float>(static_cast<int>(row) - kRadius);
    const float v = centre.y() + y;
    const int v0 = static_cast<int>(v);
    const Eight u = centre.x() + kOffsets - (slope.x() * kOffsets + slope.y() * y);
    Eight eight;
    sample_eight(image.ptr<std::uint8_t>(v0), image.step, u, v - static_cast<float>(v0), eight);
    const float last = centre.x() + kLastOffset - (slope.x() * kLastOffset + slope.y() * y);
    set_row(row, eight, bilinear(image, last, v), pixels);
  }
}

constexpr int kSideWithBorder = SlantedTemplate::kSide_px + 2;
using BorderedPixels = Eigen::Array<float, kSideWithBorder, kSideWithBorder, Eigen::RowMajor>;

/// Axis-aligned window around a point, with a border of one pixel.
[[nodiscard]] BorderedPixels sample_bordered(const cv::Mat& image, const Eigen::Vector2f& centre) {
  using Grey = Eigen::Array<std::uint8_t, kSideWithBorder, kSideWithBorder, Eigen::RowMajor>;
  const Eigen::Vector2f corner = centre.array() - static_cast<float>(kRadius + 1);
  const auto column = static_cast<int>(corner.x());
  const auto row = static_cast<int>(corner.y());
  const float right = corner.x() - static_cast<float>(column);
  const float down = corner.y() - static_cast<float>(row);
  const auto pixels = [&](int x, int y) {
    const Eigen::OuterStride<> stride(static_cast<Eigen::Index>(image.step));
    return Eigen::Map<const Grey, 0, Eigen::OuterStride<>>(image.ptr<std::uint8_t>(y) + x, stride)
        .cast<float>();
  };
  if (right == 0.0F && down == 0.0F) return pixels(column, row);  // FAST corners are at whole pixels
  return (1.0F - down) * ((1.0F - right) * pixels(column, row) + right * pixels(column + 1, row)) +
         down * ((1.0F - right) * pixels(column, row + 1) + right * pixels(column + 1, row + 1));
}

[[gnu::always_inline]] inline void differentiate(const BorderedPixels& bordered, Content& t) {
  t.value.back() = Eight{};
  for (auto& gradient : t.gradient) gradient.back() = Eight{};
  for (std::size_t row = 0; row < kRows; ++row) {
    const auto y = static_cast<float>(static_cast<int>(row) - kRadius);
    const float* here = bordered.data() + (row + 1) * kSideWithBorder;
    const float* above = here - kSideWithBorder;
    const float* below = here + kSideWithBorder;
    Eight centre, left, right, up, down;
    load(here + 1, centre);
    load(here, left);
    load(here + 2, right);
    load(above + 1, up);
    load(below + 1, down);
    const Eight dx = 0.5F * (right - left);
    const float last_dx = 0.5F * (here[kRows + 1] - here[kRows - 1]);
    set_row(row, centre, here[kRows], t.value);
    set_row(row, dx, last_dx, t.gradient[0]);
    set_row(row, 0.5F * (down - up), 0.5F * (below[kRows] - above[kRows]), t.gradient[1]);
    set_row(row, -dx * kOffsets, -last_dx * kLastOffset, t.gradient[2]);
    set_row(row, -dx * y, -last_dx * y, t.gradient[3]);
  }
}

[[gnu::always_inline]] inline void prepare(const BorderedPixels& bordered, Content& t) {
  differentiate(bordered, t);
  t.mean = sum_of(t.value) / kCount;
  subtract(t.mean, t.value);
  t.energy = product(t.value, t.value);
  for (auto& gradient : t.gradient) {
    subtract(sum_of(gradient) / kCount, gradient);
    if (!(t.energy > 0.0F)) continue;
    const float share = product(gradient, t.value) / t.energy;
    for (std::size_t i = 0; i < gradient.size(); ++i) gradient[i] -= share * t.value[i];
  }
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j <= i; ++j) {
      t.information(i, j) = t.information(j, i) =
          product(t.gradient[static_cast<std::size_t>(i)], t.gradient[static_cast<std::size_t>(j)]);
    }
  }
}

/// Sums over the pixels of a window of the right image, less a constant.
struct Sums {
  float values = 0.0F;
  float squares = 0.0F;
  float with_template = 0.0F;
  Eigen::Vector4f with_gradient;
};

/// Where a window of the right image is.
struct RightWindow {
  const cv::Mat& image;
  const Eigen::Vector2f& centre;
  const Eigen::Vector2f& slope;
};

[[gnu::always_inline]] inline void compare_window(const RightWindow& window, const Content& t, Sums& sums) {
  Pixels pixels;
  sample_slanted(window.image, window.centre, window.slope, pixels);
  subtract(t.mean, pixels);
  sums.values = sum_of(pixels);
  sums.squares = product(pixels, pixels);
  sums.with_template = product(pixels, t.value);
  for (int i = 0; i < 4; ++i) {
    sums.with_gradient[i] = product(pixels, t.gradient[static_cast<std::size_t>(i)]);
  }
}

void prepare_anywhere(const BorderedPixels& bordered, Content& t) { prepare(bordered, t); }
void compare_anywhere(const RightWindow& window, const Content& t, Sums& sums) {
  compare_window(window, t, sums);
}

#ifdef __x86_64__
[[gnu::target("avx2")]] void prepare_avx2(const BorderedPixels& bordered, Content& t) {
  prepare(bordered, t);
}
[[gnu::target("avx2")]] void compare_avx2(const RightWindow& window, const Content& t, Sums& sums) {
  compare_window(window, t, sums);
}
const bool kHasAvx2 = __builtin_cpu_supports("avx2");
#else
constexpr auto prepare_avx2 = prepare_anywhere;
constexpr auto compare_avx2 = compare_anywhere;
constexpr bool kHasAvx2 = false;
#endif

}  // namespace

SlantedTemplate::SlantedTemplate(const cv::Mat& left, const Eigen::Vector2f& centre) {
  const BorderedPixels bordered = sample_bordered(left, centre);
  kHasAvx2 ? prepare_avx2(bordered, content_) : prepare_anywhere(bordered, content_);
}

SlantedTemplate::Comparison SlantedTemplate::compare(const cv::Mat& right, const Eigen::Vector2f& centre,
                                                     const Eigen::Vector2f& slope) const {
  const RightWindow window{right, centre, slope};
  Sums sums;
  kHasAvx2 ? compare_avx2(window, content_, sums) : compare_anywhere(window, content_, sums);
  Comparison result{.gradient = sums.with_gradient};
  const float energy = content_.energy;
  if (!(energy > 0.0F)) return result;
  result.gain = sums.with_template / energy;
  const float right_energy = sums.squares - sums.values * sums.values / kCount;
  if (right_energy > 0.0F) result.correlation = sums.with_template / std::sqrt(energy * right_energy);
  return result;
}

}  // namespace stereo_slam
