// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/inertial_score.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <stdexcept>
#include <string_view>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <fmt/format.h>
#include <fmt/ostream.h>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/table_row.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;
using Vec = Vector3<double>;

constexpr int kNumbers = InertialEstimate::kNumbers;

/// The numbers of some fields, which must be finite.
[[nodiscard]] std::optional<std::vector<double>> numbers_of(const std::vector<std::string_view>& fields,
                                                            std::size_t begin, std::size_t end) {
  std::vector<double> numbers;
  for (std::size_t i = begin; i < end; ++i) {
    const auto number = parse_numbers(fields[i]);
    if (!number || number->size() != 1) return std::nullopt;
    numbers.push_back(number->front());
  }
  return numbers;
}

[[nodiscard]] InertialEstimate estimate_of(const std::vector<double>& numbers) {
  InertialEstimate estimate{.phase = InertialPhase::kRunning,
                            .velocity = Vec(numbers.data()),
                            .gravity = Vec(numbers.data() + 3),
                            .biases = Vector6<double>(numbers.data() + 6),
                            .delay_s = numbers[12]};
  std::size_t next = kNumbers;
  for (int i = 0; i < kNumbers; ++i) {
    for (int j = i; j < kNumbers; ++j)
      estimate.covariance(i, j) = estimate.covariance(j, i) = numbers[next++];
  }
  return estimate;
}

/// The state between two, at a stamp.
[[nodiscard]] TrueInertialState between(const TrueInertialState& a, const TrueInertialState& b,
                                        std::int64_t stamp_ns) {
  if (a.stamp_ns == b.stamp_ns) return a;
  const double share =
      static_cast<double>(stamp_ns - a.stamp_ns) / static_cast<double>(b.stamp_ns - a.stamp_ns);
  const Eigen::Quaterniond qa(a.R_world_imu), qb(b.R_world_imu);
  return {.stamp_ns = stamp_ns,
          .R_world_imu = qa.slerp(share, qb).toRotationMatrix(),
          .velocity = a.velocity + share * (b.velocity - a.velocity),
          .biases = a.biases};
}

/// The true state at a stamp; nothing if there is none near on either side.
[[nodiscard]] std::optional<TrueInertialState> state_at(const std::vector<TrueInertialState>& truth,
                                                        std::int64_t stamp_ns, std::int64_t most_ns) {
  const auto after = std::ranges::lower_bound(truth, stamp_ns, {}, &TrueInertialState::stamp_ns);
  if (after == truth.end() || after->stamp_ns - stamp_ns > most_ns) return std::nullopt;
  if (after->stamp_ns == stamp_ns) return *after;
  if (after == truth.begin() || stamp_ns - std::prev(after)->stamp_ns > most_ns) return std::nullopt;
  return between(*std::prev(after), *after, stamp_ns);
}

/// Adds up the errors of a part of the state.
class PartErrors {
 public:
  explicit PartErrors(double bound) : bound_(bound) {}

  /// Of a frame; `length` is that of the error, or of its part that is told.
  void add(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance, double length) {
    const double nees = error.dot(Eigen::LDLT<Eigen::MatrixXd>(covariance).solve(error));
    ++frames_;
    squares_ += length * length;
    nees_ += nees;
    inside_ += nees < bound_ ? 1 : 0;
  }

  [[nodiscard]] InertialPartScore score() const {
    if (frames_ == 0) return {};
    const auto count = static_cast<double>(frames_);
    return {frames_, std::sqrt(squares_ / count), nees_ / count, static_cast<double>(inside_) / count};
  }

 private:
  double bound_;
  std::size_t frames_ = 0, inside_ = 0;
  double squares_ = 0.0, nees_ = 0.0;
};

/// The axis of the world that is nearest to a direction.
[[nodiscard]] Vec nearest_axis(const Vec& direction) {
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return std::copysign(1.0, direction[axis]) * Vec::Unit(axis);
}

struct ScoredFrame {
  const InertialEstimate* estimate;
  TrueInertialState truth;
};

void add_tilt(const ScoredFrame& frame, const Vec& down, PartErrors& errors) {
  const Vec& gravity = frame.estimate->gravity;
  const double length = gravity.norm();
  // The length of gravity is known, so its error is across it.
  antipode::Matrix<double, 3, 2> across;
  across.col(0) = gravity.unitOrthogonal();
  across.col(1) = gravity.normalized().cross(across.col(0));
  const Vec true_gravity = length * (frame.truth.R_world_imu.transpose() * down);
  const antipode::Vector<double, 2> error = across.transpose() * (gravity - true_gravity);
  const antipode::Matrix<double, 2> P =
      across.transpose() * frame.estimate->covariance.block<3, 3>(3, 3) * across;
  const double angle = std::atan2(gravity.cross(true_gravity).norm(), gravity.dot(true_gravity));
  errors.add(error, P, angle);
}

/// Scores the delay in all frames.
void score_delay(const std::vector<ScoredFrame>& frames, double true_delay_s, InertialScore& score) {
  constexpr int kDelay = 12;
  PartErrors errors(kChi2_1_95);
  for (const auto& frame : frames) {
    const Eigen::VectorXd error = Eigen::VectorXd::Constant(1, frame.estimate->delay_s - true_delay_s);
    errors.add(error, frame.estimate->covariance.block<1, 1>(kDelay, kDelay), error[0]);
  }
  score.delay = errors.score();
  score.last_delay_error_s = frames.back().estimate->delay_s - true_delay_s;
}

void print_part(std::ostream& stream, std::string_view name, const std::string& rms,
                const InertialPartScore& score, int expected) {
  fmt::print(stream, "{:<32}rms {}  NEES {:.2f} ({} expected)  inside 95 %: {:.0f} % of {} frames\n", name,
             rms, score.mean_nees, expected, 100.0 * score.share_inside, score.frames);
}

[[nodiscard]] std::string part_json(const InertialPartScore& score) {
  return fmt::format(R"("rms": {}, "mean_nees": {}, "share_inside_95": {}, "frames": {})", score.rms,
                     score.mean_nees, score.share_inside, score.frames);
}

}  // namespace

std::vector<InertialRow> read_inertial(const fs::path& file) {
  constexpr std::size_t kColumns = 2 + kNumbers + kNumbers * (kNumbers + 1) / 2;
  const auto lines = read_text_lines(file);
  if (lines.empty() || !lines.front().text.starts_with("stamp_s,phase,vx_m_s"))
    fail(file, "is not the inertial.csv of a run with --imu");
  std::vector<InertialRow> rows;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const auto fields = split_row(lines[i].text, ',');
    const auto stamp_ns = fields.size() == kColumns ? parse_seconds(fields[0]) : std::nullopt;
    if (!stamp_ns) fail_at(file, lines[i].number, "is no stamp, phase and {} numbers", kColumns - 2);
    if (fields[1] != to_string(InertialPhase::kRunning)) continue;
    const auto numbers = numbers_of(fields, 2, kColumns);
    if (!numbers) fail_at(file, lines[i].number, "has a field that is no finite number");
    rows.push_back({*stamp_ns, estimate_of(*numbers)});
  }
  return rows;
}

std::vector<TrueInertialState> read_true_inertial_states(const fs::path& file) {
  constexpr std::size_t kWithVelocity = 11, kWithBiases = 17;
  std::vector<TrueInertialState> states;
  for (const auto& line : read_text_lines(file)) {
    if (line.text.starts_with("#")) continue;
    const auto fields = split_row(line.text, separator_of(line.text));
    if (fields.size() < kWithVelocity)
      fail_at(
          file, line.number,
          "has {} fields, but a ground truth with velocities has stamp, position, quaternion and velocity, "
          "and biases if it knows them, as EuRoC's state_groundtruth_estimate0/data.csv",
          fields.size());
    const bool with_biases = fields.size() >= kWithBiases;
    const auto stamp_ns = parse_nanoseconds(fields[0]);
    const auto numbers = numbers_of(fields, 1, with_biases ? kWithBiases : kWithVelocity);
    if (!stamp_ns || !numbers) fail_at(file, line.number, "has a field that is no finite number");
    const double* x = numbers->data();
    const Eigen::Quaterniond q(x[3], x[4], x[5], x[6]);
    if (!(std::abs(q.norm() - 1.0) < 0.1))
      fail_at(file, line.number, "has a quaternion that is not of unit length");
    states.push_back({*stamp_ns, q.normalized().toRotationMatrix(), Vec(x + 7), {}});
    if (with_biases) states.back().biases = Vector6<double>(x + 10);
  }
  std::ranges::stable_sort(states, {}, &TrueInertialState::stamp_ns);
  return states;
}

InertialScore score_inertial(const std::vector<InertialRow>& rows,
                             const std::vector<TrueInertialState>& truth, double max_difference_s,
                             std::optional<double> true_delay_s) {
  const std::int64_t most_ns = std::llround(1e9 * max_difference_s);
  std::vector<ScoredFrame> frames;
  Vec gravity = Vec::Zero();
  for (const auto& row : rows) {
    const auto state = state_at(truth, row.stamp_ns, most_ns);
    if (!state) continue;
    frames.push_back({&row.estimate, *state});
    gravity += state->R_world_imu * row.estimate.gravity;
  }
  if (frames.empty()) throw std::runtime_error("no frame in which the filter ran has a true state near it");
  InertialScore score{.velocity = {}, .tilt = {}, .biases = {}, .delay = {}, .down = nearest_axis(gravity)};
  PartErrors velocity(kChi2_3_95), tilt(kChi2_2_95), biases(kChi2_6_95);
  double accelerometer = 0.0;
  for (const auto& frame : frames) {
    const auto& [estimate, state] = frame;
    const Vec error = estimate->velocity - state.R_world_imu.transpose() * state.velocity;
    velocity.add(error, estimate->covariance.topLeftCorner<3, 3>(), error.norm());
    add_tilt(frame, score.down, tilt);
    if (!state.biases) continue;
    const Vector6<double> bias_error = estimate->biases - *state.biases;
    biases.add(bias_error, estimate->covariance.block<6, 6>(6, 6), bias_error.head<3>().norm());
    accelerometer += bias_error.tail<3>().squaredNorm();
  }
  score.velocity = velocity.score();
  score.tilt = tilt.score();
  score.biases = biases.score();
  score.accelerometer_bias_rms =
      std::sqrt(accelerometer / static_cast<double>(std::max<std::size_t>(score.biases.frames, 1)));
  if (true_delay_s) score_delay(frames, *true_delay_s, score);
  return score;
}

void print_inertial_score(std::ostream& stream, const InertialScore& score) {
  print_part(stream, "velocity", fmt::format("{:.4g} m/s", score.velocity.rms), score.velocity, 3);
  print_part(stream, "tilt", fmt::format("{:.3g} degrees", 180.0 / std::numbers::pi * score.tilt.rms),
             score.tilt, 2);
  if (score.biases.frames == 0) {
    fmt::print(stream, "{:<32}n/a (the ground truth has none)\n", "biases");
  } else {
    print_part(stream, "biases",
               fmt::format("{:.2g} rad/s, {:.2g} m/s^2", score.biases.rms, score.accelerometer_bias_rms),
               score.biases, 6);
  }
  if (score.delay.frames == 0) return;
  print_part(stream, "delay",
             fmt::format("{:.3f} ms (last {:+.3f})", 1e3 * score.delay.rms, 1e3 * score.last_delay_error_s),
             score.delay, 1);
}

std::string inertial_score_json(const InertialScore& score) {
  std::string delay;
  if (score.delay.frames > 0)
    delay = fmt::format(R"("delay_s": {{"last_error": {}, {}}}, )", score.last_delay_error_s,
                        part_json(score.delay));
  return fmt::format(
      R"({{"velocity_m_s": {{{}}}, "tilt_rad": {{{}}}, "biases": {{"accelerometer_rms_m_s2": {}, {}}}, {}"down": [{}, {}, {}]}})",
      part_json(score.velocity), part_json(score.tilt), score.accelerometer_bias_rms, part_json(score.biases),
      delay, score.down.x(), score.down.y(), score.down.z());
}

}  // namespace stereo_slam
