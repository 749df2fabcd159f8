// SPDX-License-Identifier: MIT
#include "stereo_slam/inertial/inertial_filter.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>
#include <utility>

#include <antipode/distributions/keyframe_change.hpp>
#include <antipode/filters/marginal_update.hpp>

#include "stereo_slam/inertial/read_motion.hpp"

namespace stereo_slam {
namespace {

constexpr int kMostRestarts = 1;
constexpr int kEnoughForCause = 20;               // motions at the start, before which waiting costs nothing
constexpr int kFramesBetweenChecks = 50;          // of the delay
constexpr std::int64_t kMargin_ns = 300'000'000;  // samples kept before the oldest rotation

/// The standard deviation of a position or velocity whose covariance is a block of the state's.
[[nodiscard]] double sigma_of(const InertialState& state, int block) {
  return std::sqrt(state.covariance.block<3, 3>(block, block).trace() / 3.0);
}

/// Whether velocity and tilt are known well enough to predict the motion.
[[nodiscard]] bool is_known(const InertialState& itself) {
  constexpr double kVelocity_m_s = 0.2, kTilt_rad = 0.05;
  return sigma_of(itself, StatePart::kNu) < kVelocity_m_s &&
         sigma_of(itself, StatePart::kGamma) < kTilt_rad * kGravity;
}

/// Whether gravity has its length, within the error that the state has and that of a usual scale.
[[nodiscard]] bool has_length_of_gravity(const InertialState& itself) {
  constexpr double kScale = 0.02 * kGravity, kSigmas = 4.0;
  const GravityLength gravity = gravity_length(itself);
  return std::abs(gravity.length - kGravity) < kSigmas * std::sqrt(gravity.variance + kScale * kScale);
}

}  // namespace

void InertialFilter::begin_frame(std::int64_t stamp_ns, const std::optional<ImuReadings>& imu) {
  predicted_.reset();
  given_up_ = false;
  if (!imu || summary_.phase == InertialPhase::kOff) return;
  sensor_ = imu->sensor;
  for (ImuSample sample : imu->samples) {
    sample.stamp_ns -= moved_ns_;
    if (!is_plausible(sample) || (!samples_.empty() && sample.stamp_ns <= samples_.back().stamp_ns)) continue;
    samples_.push_back(sample);
    noise_.add(sample);
  }
  if (summary_.phase == InertialPhase::kNone) summary_.phase = InertialPhase::kStarting;
  if (!begun_ || !running()) return;
  constexpr std::int64_t kLongest_ns = 10'000'000'000;
  if (stamp_ns - stamp_ns_ > kLongest_ns) return samples_.clear();
  constexpr double kFarthest_m = 0.5;  // a position less certain than that is no prediction
  const ReadMotion read = motion_of(state_, {stamp_ns_, stamp_ns});
  if (read.motion.status != antipode::InertialStatus::kComplete) return;
  predicted_ = step(state_, read);
  if (!(sigma_of(predicted_->state, StatePart::kRho) < kFarthest_m)) predicted_.reset();
}

/// The motion of a state between two images.
ReadMotion InertialFilter::motion_of(const InertialState& state, const antipode::TimeInterval& images) const {
  ReadMotion read = read_motion(samples_, images, state, noise_.densities(sensor_.noise));
  read.drift = drift_.of_motion();
  return read;
}

PoseGaussian InertialFilter::in_imu(const PoseGaussian& camera) const {
  return conjugated(sensor_.T_camera_imu.inverse(), camera);
}

PoseGaussian InertialFilter::in_camera(const PoseGaussian& imu) const {
  return conjugated(sensor_.T_camera_imu, imu);
}

std::optional<Matrix6<double>> InertialFilter::drift_covariance() const {
  if (!running()) return std::nullopt;
  const Matrix6<double> of_drift = state_.covariance.block<6, 6>(StatePart::kDrift, StatePart::kDrift);
  return in_camera({Pose::identity(), drift_.covariance(of_drift)}).covariance;
}

Pose InertialFilter::predicted_motion() const {
  return in_camera({predicted_->T_previous_current(), Matrix6<double>::Zero()}).pose;
}

InertialPrior InertialFilter::prior(const std::optional<PoseGaussian>& T_previous_current) const {
  InertialPrior prior{.step = *predicted_, .T_keyframe_camera = {}};
  if (T_previous_current) {
    FusedStep fused = fuse(*predicted_, in_imu(*T_previous_current));
    prior.nis = fused.nis;
    prior.contradicts = !(fused.nis < InnovationMonitor::kImpossible);
    if (!prior.contradicts) prior.step = std::move(fused.step);
  }
  prior.T_keyframe_camera = in_camera(antipode::pose_marginal(prior.step.state));
  const Matrix6<double> to_camera = sensor_.T_camera_imu.adjoint();
  prior.camera_regression =
      to_camera * prior.step.pose_regression() * sensor_.T_camera_imu.inverse().adjoint();
  return prior;
}

void InertialFilter::begin_map(std::int64_t stamp_ns) {
  keyframe_ns_ = stamp_ns;
  begin(stamp_ns, unknown());
}

/// Begins to estimate a state relative to the IMU itself.
void InertialFilter::begin(std::int64_t stamp_ns, const InertialState& itself) {
  if (summary_.phase == InertialPhase::kRunning) summary_.phase = InertialPhase::kStarting;
  state_ = itself;
  stamp_ns_ = start_ns_ = stamp_ns;
  motions_ = 0;
  started_.clear();
  started_at_s_ = std::get<3>(itself.state)[0];
  begun_ = true;
  innovations_ = {};
}

void InertialFilter::end_frame(const SeenFrame& seen, const std::optional<InertialPrior>& prior) {
  if (!begun_ || summary_.phase == InertialPhase::kNone || summary_.phase == InertialPhase::kOff) return;
  remember(seen);
  if (seen.T_previous_current) drift_.see(in_imu(*seen.T_previous_current));
  const bool refuted = running() && seen.refutes_imu;
  if (running() && !refuted) {
    continue_run(seen, prior);
  } else if (!refuted) {
    continue_start(seen);
  }
  summary_.nis = innovations_.mean();
  if (refuted || (innovations_.contradicts() && (running() || motions_ >= kEnoughForCause))) {
    give_up(seen);
  } else if (++frames_ % kFramesBetweenChecks == 0) {
    correct_delay(seen, std::llround(1e9 * std::get<3>(state_.state)[0]));
  }
  predicted_.reset();
  forget_samples();
  if (running()) summarise();
}

/// What was found of the sensor.
void InertialFilter::summarise() {
  summary_.delay_s = 1e-9 * static_cast<double>(moved_ns_) + std::get<3>(state_.state)[0];
  summary_.delay_sigma_s = std::sqrt(std::max(state_.covariance(StatePart::kDelay, StatePart::kDelay), 0.0));
  summary_.turn_rad = std::get<2>(state_.state);
  summary_.offset_m = std::get<4>(state_.state);
  const auto sigma = [this](int part) -> Vector3<double> {
    return state_.covariance.diagonal().segment<3>(part).cwiseMax(0.0).cwiseSqrt();
  };
  summary_.turn_sigma_rad = sigma(StatePart::kTurn);
  summary_.offset_sigma_m = sigma(StatePart::kOffset);
}

/// Estimates the state by the motion that the images show.
void InertialFilter::continue_start(const SeenFrame& seen) {
  const ReadMotion read = motion_of(state_, {stamp_ns_, seen.stamp_ns});
  const bool complete = read.motion.status == antipode::InertialStatus::kComplete;
  if (!seen.T_previous_current || !complete) return begin(seen.stamp_ns, unknown());
  const FusedStep fused = fuse(step(state_, read), in_imu(*seen.T_previous_current));
  innovations_.add(fused.nis, false);
  state_ = relative_to_itself(fused.step.state);
  stamp_ns_ = seen.stamp_ns;
  ++motions_;
  started_.push_back({stamp_ns_, in_imu(*seen.T_previous_current)});
  try_to_run(seen);
}

/// Estimates the state anew from the motions of the start, about the delay that they told: what is left of a
/// large one after a correction of first order may be some milliseconds.
void InertialFilter::relinearise_start() {
  constexpr double kFar_s = 0.002;    // at which the second order is less than the standard deviation
  constexpr std::size_t kMost = 100;  // motions whose samples are kept
  const double delay_s = std::get<3>(state_.state)[0];
  if (std::abs(delay_s - started_at_s_) < kFar_s || started_.size() > kMost) return;
  InertialState state = unknown();
  std::get<3>(state.state)[0] = delay_s;
  std::int64_t begin_ns = start_ns_;
  for (const auto& [end_ns, motion] : started_) {
    const ReadMotion read = motion_of(state, {begin_ns, end_ns});
    if (read.motion.status != antipode::InertialStatus::kComplete) return;
    state = relative_to_itself(fuse(step(state, read), motion).step.state);
    begin_ns = end_ns;
  }
  state_ = state;
  started_at_s_ = delay_s;
}

/// Runs from now on, if enough is known. If gravity has another length than it must have, it starts anew.
void InertialFilter::try_to_run(const SeenFrame& seen) {
  constexpr int kFewestMotions = 8;
  constexpr std::int64_t kShortest_ns = 500'000'000;
  const bool long_enough = motions_ >= kFewestMotions && seen.stamp_ns - start_ns_ >= kShortest_ns;
  if (!long_enough || !is_known(state_) || innovations_.contradicts()) return;
  relinearise_start();
  if (!has_length_of_gravity(state_)) {
    if (motions_ >= kEnoughForCause) give_up(seen);
    return;
  }
  state_ = at_pose(with_known_gravity(state_), in_imu(seen.T_keyframe_camera));
  const Matrix3<double> R_imu_camera = sensor_.T_camera_imu.rotation_matrix().transpose();
  state_ =
      with_path_error(state_, R_imu_camera * tilt_path_.rotation_covariance() * R_imu_camera.transpose());
  tilt_path_.begin(R_imu_camera.transpose() * std::get<0>(state_.state).vectors.col(0));
  summary_.phase = InertialPhase::kRunning;
  ++summary_.starts;
}

/// Takes the pose of the frame over, and corrects the rest with it.
void InertialFilter::continue_run(const SeenFrame& seen, const std::optional<InertialPrior>& prior) {
  if (!prior) return cross_gap(seen);
  if (prior->nis) innovations_.add(*prior->nis, prior->contradicts && seen.by_landmarks);
  const PoseGaussian pose = in_imu(seen.T_keyframe_camera);
  if (seen.relocalised) {
    state_ = at_pose(relative_to_itself(prior->step.state), pose);
  } else {
    const auto updated = antipode::with_marginal(prior->step.state, pose);
    if (updated.status != antipode::MarginalStatus::kUpdated) return begin(seen.stamp_ns, unknown());
    state_ = antipode::with_gravity_length(updated.posterior, kGravity);
  }
  drift_.move(prior->step.T_previous_current());
  stamp_ns_ = seen.stamp_ns;
}

/// A frame without prediction, because samples are missing or it is too uncertain: gravity turns with the
/// pose, if that is known, and the velocity has to be found again.
void InertialFilter::cross_gap(const SeenFrame& seen) {
  if (!seen.T_previous_current) return begin(seen.stamp_ns, unknown());
  InertialState moved = relative_to_itself(state_);
  const PoseGaussian motion = in_imu(*seen.T_previous_current);
  auto& x = std::get<0>(moved.state);
  x.vectors = (motion.pose.rotation_matrix().transpose() * x.vectors).eval();
  begin(seen.stamp_ns, without_velocity(moved));
}

/// The readings contradict the images: they are tried again, and after some times not used any more.
void InertialFilter::give_up(const SeenFrame& seen) {
  given_up_ = running();
  ++summary_.restarts;
  if (correct_delay(seen, 0)) return;  // the state could not account for one
  if (summary_.restarts <= kMostRestarts) return begin(seen.stamp_ns, unknown());
  summary_.phase = InertialPhase::kOff;
  summary_.fault = probable_fault(rotations_, samples_, moved_ns_ + sensor_.known_delay_ns);
  samples_.clear();
  rotations_.clear();
}

/// Looks for an evident delay between the clocks that is far from the one that is accounted for, too far to
/// be found step by step. Takes it out and starts anew. Returns whether there was one.
bool InertialFilter::correct_delay(const SeenFrame& seen, std::int64_t accounted_ns) {
  constexpr int kMostCorrections = 5;
  constexpr std::int64_t kFar_ns = 10'000'000;  // three times the error of what the rotations tell
  if (corrections_ >= kMostCorrections) return false;
  const auto later_ns = seen_delay_ns(rotations_, samples_);
  if (!later_ns || std::abs(*later_ns - accounted_ns) < kFar_ns) return false;
  ++corrections_;
  // The stamps of all samples, those to come too. What remains of the delay is not known any more.
  moved_ns_ += *later_ns;
  for (auto& sample : samples_) sample.stamp_ns -= *later_ns;
  begin(seen.stamp_ns, unknown());
  return true;
}

/// The state before anything was measured.
InertialState InertialFilter::unknown() const {
  return unknown_state(moved_ns_ == 0 ? sensor_.delay_sigma_s : kUnknownDelaySigma_s);
}

void InertialFilter::remember(const SeenFrame& seen) {
  constexpr std::size_t kMost = 100;
  if (!seen.T_previous_current || seen.stamp_ns <= stamp_ns_) return;
  const Vector6<double> motion = in_imu(*seen.T_previous_current).pose.log();
  rotations_.push_back({stamp_ns_, seen.stamp_ns, motion.head<3>()});
  if (rotations_.size() > kMost) rotations_.erase(rotations_.begin());
}

/// Samples that no later step needs, and no search for a fault.
void InertialFilter::forget_samples() {
  const std::int64_t oldest_ns = rotations_.empty() ? stamp_ns_ : rotations_.front().begin_ns;
  const auto kept = std::ranges::lower_bound(samples_, std::min(oldest_ns, stamp_ns_) - kMargin_ns, {},
                                             &ImuSample::stamp_ns);
  samples_.erase(samples_.begin(), kept);
}

void InertialFilter::remeasure(const Vector6<double>& change) {
  if (!begun_ || stamp_ns_ <= keyframe_ns_) return;
  // The motions before had about the same velocity, and change alike.
  const double since_s = 1e-9 * static_cast<double>(stamp_ns_ - keyframe_ns_);
  auto& x = std::get<0>(state_.state);
  const Vector3<double> change_m = sensor_.T_camera_imu.rotation_matrix().transpose() * change.tail<3>();
  x.velocity += x.pose.rotation_matrix() * change_m / since_s;
}

LevelledLink InertialFilter::change_keyframe(const PoseGaussian& T_previous_keyframe) {
  constexpr double kCorrelation_s = 1.0;  // of the errors of links by the images (docs/results/inertial.md)
  const double link_s = 1e-9 * static_cast<double>(stamp_ns_ - std::exchange(keyframe_ns_, stamp_ns_));
  drift_.begin_keyframe();
  if (!running()) return tilt_path_.add(T_previous_keyframe, std::nullopt);
  state_ = relative_to_itself(state_);
  const Matrix3<double> R = sensor_.T_camera_imu.rotation_matrix();
  const Matrix3<double> of_path = state_.covariance.block<3, 3>(StatePart::kPath, StatePart::kPath);
  const Vector3<double> turn = std::exchange(std::get<6>(state_.state), Vector3<double>::Zero());
  LevelledLink link = tilt_path_.add(T_previous_keyframe, KnownTurn{R * turn, R * of_path * R.transpose()});
  link.levelling.share_before = std::exp(-link_s / kCorrelation_s);
  return link;
}

InertialEstimate InertialFilter::estimate() const {
  if (!running()) return {.phase = summary_.phase};
  InertialEstimate estimate = estimate_of(relative_to_itself(predicted_ ? predicted_->state : state_));
  estimate.delay_s += 1e-9 * static_cast<double>(moved_ns_);
  return estimate;
}

}  // namespace stereo_slam
