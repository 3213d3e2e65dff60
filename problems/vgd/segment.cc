#include "problems/vgd/segment.h"

#include <glog/logging.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "problems/log/samples.h"

namespace trueline {
namespace {

// Mean thrust around t: single samples contain vibration and noise, which would attenuate what this
// factor multiplies, drag or a misalignment of the accelerometer.
double MeanThrust(const DriveTrack& track, TimeNs t) {
  constexpr double kThrustReach = 0.05;  // s, to either side
  const DriveSteps steps = track.steps();
  const std::size_t middle = track.StepAt(t);
  std::size_t first = middle, last = middle;
  while (first > 0 && SecondsBetween(steps[first - 1].t, t) <= kThrustReach) --first;
  while (last + 1 < steps.size() && SecondsBetween(t, steps[last + 1].t) <= kThrustReach) ++last;
  double sum = 0.0;
  for (std::size_t i = first; i <= last; ++i) sum -= steps[i].drive.a_z;
  return sum / static_cast<double>(last - first + 1);
}

// A parameter or a state's number, to differentiate by one column where T has columns.
template <typename T>
T Unknown(double value, [[maybe_unused]] int column, [[maybe_unused]] double unit = 1.0) {
  T x(value);
  if constexpr (std::is_same_v<T, MotionJet>) x.v[column] = unit;
  return x;
}

}  // namespace

// The initial position only adds, and the accelerometer's biases b_ax and b_ay do not affect the
// motion, so their derivatives are known.
template <typename T, int kSize>
void Segment::Store(const Eigen::Matrix<T, kSize, 1>& x, SegmentNode<kSize>* node) const {
  if constexpr (std::is_same_v<T, double>) {
    node->value = x;
  } else {
    for (int row = 0; row < kSize; ++row) {
      node->value[row] = x[row].a;
      const auto slopes = x[row].v.transpose();
      node->d_theta.row(row).template head<kMotionSize>() = slopes.template head<kMotionSize>();
      node->d_state.row(row).template tail<3>() = slopes.template tail<3>();
    }
    node->d_theta.template rightCols<kFilterSize>().noalias() = node->d_drift() * attitude_errors_;
  }
}

ParameterScaling::ParameterScaling(const VgdOptions& options) {
  for (int i = 0; i < kThetaSize; ++i) {
    mean[i] = options.PriorOf(i).mean;
    sigma[i] = options.PriorOf(i).sigma;
  }
  // A rigid integration has one segment: the errors' courses do not show.
  if (!options.process.Any()) sigma.tail<kFilterSize>().setZero();
}

namespace {

// z of the IMU. E' replaces E.
Eigen::Vector3d ThrustAxisAt(const DriveTrack& track, TimeNs t) {
  return track.steps()[track.StepAt(t)].drive.R_Ep_I.col(2);
}

// Derivatives of (p_E, v_E) at the chain's times to the gusts at its ends.
std::vector<StateByGusts::Slope> GustSlopes(const DriveTrack& track, const MotionChain& chain) {
  constexpr double kStep = 0.05;  // s, in which the axis of the thrust is constant
  StateByGusts state(SecondsBetween(chain.start(), chain.times().back()));
  std::vector<StateByGusts::Slope> slopes;
  TimeNs at = chain.start();
  for (const TimeNs t : chain.times()) {
    const int steps = static_cast<int>(std::ceil(SecondsBetween(at, t) / kStep));
    const TimeNs from = at;
    for (int i = 1; i <= steps; ++i) {
      const TimeNs to = from + (t - from) * i / steps;
      state.Advance(SecondsBetween(chain.start(), to), ThrustAxisAt(track, at + (to - at) / 2));
      at = to;
    }
    slopes.push_back(state.d());
  }
  return slopes;
}

std::vector<TimeNs> Merged(const std::vector<TimeNs>& a, const std::vector<TimeNs>& b) {
  std::vector<TimeNs> all;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  return all;
}

}  // namespace

Segment::Segment(const DriveTrack& track, TimeNs start, const std::vector<TimeNs>& times,
                 const std::vector<TimeNs>& force_times, const ParameterScaling& scaling,
                 double max_block)
    : chain_(track, start, Merged(times, force_times), max_block),
      scaling_(&scaling),
      attitude_errors_(scaling.DriftUnit().cwiseInverse().asDiagonal() *
                       track.attitude_errors().MeanOver(start, chain_.times().back()) *
                       scaling.sigma.tail<kFilterSize>().asDiagonal()),
      thrust_axis_(ThrustAxisAt(track, start + (chain_.times().back() - start) / 2)),
      gravity_(track.gravity()),
      axis_(track.thrust_axis()),
      effects_(track.force_effects()),
      states_(chain_.times().size()),
      by_gusts_(GustSlopes(track, chain_)) {
  for (StateNode& node : states_) node.d_state.topLeftCorner<3, 3>().setIdentity();
  forces_.reserve(force_times.size());
  for (const TimeNs t : force_times) {
    const double thrust = MeanThrust(track, t);
    const Drive drive{track.steps()[track.StepAt(t)].drive.R_Ep_I, -thrust};
    forces_.push_back(
        {IndexOf(t), SecondsBetween(track.log_start(), t), drive, thrust, ForceNode()});
    forces_.back().node.d_theta.middleCols<2>(kForceBiasInTheta) =
        Eigen::Vector2d(scaling.sigma.segment<2>(kForceBiasInTheta)).asDiagonal();
  }
}

std::size_t Segment::IndexOf(TimeNs t) const {
  const auto& times = chain_.times();
  const auto it = std::lower_bound(times.begin(), times.end(), t);
  CHECK(it != times.end() && *it == t) << "the segment has no node at that time";
  return static_cast<std::size_t>(it - times.begin());
}

const Segment::Force& Segment::FindForce(TimeNs t) const {
  const std::size_t index = IndexOf(t);
  const auto it = std::ranges::lower_bound(forces_, index, {}, &Force::time_index);
  CHECK(it != forces_.end() && it->time_index == index);
  return *it;
}

const ForceNode* Segment::ForceAt(TimeNs t) const { return &FindForce(t).node; }

// E' replaces E: the gust's direction is off by the AHRS's small error.
Eigen::Matrix<double, 2, 4> Segment::ForceByGusts(const Force& force) const {
  const TimeNs t = times()[force.time_index];
  const double u = SecondsBetween(start(), t) / SecondsBetween(start(), end());
  const Eigen::Matrix2d R_I_E = force.drive.R_Ep_I.transpose().topLeftCorner<2, 2>();
  Eigen::Matrix<double, 2, 4> d;
  d << (1.0 - u) * R_I_E, u * R_I_E;
  return d;
}

Eigen::Matrix<double, 2, 4> Segment::ForceGustsAt(TimeNs t) const {
  return ForceByGusts(FindForce(t));
}

Eigen::Matrix<double, 3, 2> Segment::BodyAxesAtStart() const {
  if (forces_.empty()) return Eigen::Matrix<double, 3, 2>::Zero();
  return forces_.front().drive.R_Ep_I.leftCols<2>();
}

void Segment::AddGusts(const GustPair& gusts) {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    states_[i].value += by_gusts_[i] * gusts;
  }
  for (Force& force : forces_) force.node.value += ForceByGusts(force) * gusts;
}

template <typename T>
void Segment::Integrate(const Inputs& at) {
  const Vector x = scaling_->mean + scaling_->sigma.cwiseProduct(at.theta);
  T theta[kMotionSize];
  for (int i = 0; i < kMotionSize; ++i) theta[i] = Unknown<T>(x[i], i, scaling_->sigma[i]);
  MotionState<T> start;
  for (int i = 0; i < 3; ++i) {
    start.p[i] = T(at.state[i]);
    start.v[i] = Unknown<T>(at.state[3 + i], kMotionSize + i);
  }
  const ImuDrivenModel<T> model(ImuDrivenParameters<T>::FromArray(theta), gravity_, axis_);
  auto force = forces_.begin();
  const auto visit = [&](std::size_t i, const MotionState<T>& state, const Vector3<T>& v_Ep) {
    Eigen::Matrix<T, kStateSize, 1> both;
    both.template head<3>() = state.p;
    both.template tail<3>() = state.v;
    Store(both, &states_[i]);
    if (force == forces_.end() || force->time_index != i) return;
    const Eigen::Matrix3d& R_Ep_I = force->drive.R_Ep_I;
    Vector3<T> f_I = model.ForceInImu(force->drive.a_z, Times(R_Ep_I.transpose(), v_Ep));
    if (effects_.Any()) {
      f_I += effects_.ForceInImu(
          model, R_Ep_I, v_Ep, [&] { return state.p; }, force->thrust, force->t);
    }
    Store(Eigen::Matrix<T, 2, 1>(f_I.template head<2>()), &force->node);
    force->node.value += x.segment<2>(kForceBiasInTheta);
    ++force;
  };
  chain_.Integrate(model, start, visit, &effects_);
}

namespace {

// The largest step of a parameter that is near, in its unit.
double NearOf(ParameterGroup group) {
  if (group == ParameterGroup::kDrag) return 0.0005;  // 1/s
  if (group == ParameterGroup::kBias) return 0.005;   // m/s^2
  return 0.0003;                                      // rad
}

}  // namespace

// True if the second-order part of the step (angle by angle and time squared, drag by velocity) is
// at most a few micrometres over a second, so that the optimiser sees no jump in the cost.
bool Segment::IsNear(const Inputs& at) const {
  constexpr double kVelocity = 0.005;  // m/s
  if (!follows_ || !linearised_at_) return false;
  const Vector moved = scaling_->sigma.cwiseProduct(at.theta - linearised_at_->theta).cwiseAbs();
  const Eigen::Vector3d v = at.state.tail<3>() - linearised_at_->state.tail<3>();
  for (int i = 0; i < kMotionSize; ++i) {
    if (!(moved[i] < NearOf(kTheta[i].group))) return false;
  }
  return v.cwiseAbs().maxCoeff() < kVelocity;
}

void Segment::Extrapolate(const Inputs& to) {
  const Vector theta = to.theta - linearised_at_->theta;
  const Eigen::Matrix<double, kStateSize, 1> state = to.state - linearised_at_->state;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    states_[i].value = states_there_[i] + states_[i].d_theta * theta + states_[i].d_state * state;
  }
  for (std::size_t i = 0; i < forces_.size(); ++i) {
    ForceNode& node = forces_[i].node;
    node.value = forces_there_[i] + node.d_theta * theta + node.d_state * state;
  }
}

void Segment::Linearise(const Inputs& at) {
  Integrate<MotionJet>(at);
  if (!follows_) return;
  linearised_at_ = at;
  states_there_.clear();
  for (const StateNode& node : states_) states_there_.push_back(node.value);
  forces_there_.clear();
  for (const Force& force : forces_) forces_there_.push_back(force.node.value);
}

void Segment::Evaluate(const double* theta, const double* drift, const double* state,
                       bool derivatives) {
  Inputs at{Eigen::Map<const Eigen::Matrix<double, kThetaSize, 1>>(theta),
            Eigen::Map<const Eigen::Matrix<double, kStateSize, 1>>(state)};
  at.theta.segment<kDriftSize>(kAhrsInTheta) +=
      Eigen::Map<const Eigen::Vector3d>(drift) + attitude_errors_ * at.theta.tail<kFilterSize>();
  at.theta.tail<kFilterSize>().setZero();
  if (IsNear(at)) {
    Extrapolate(at);
  } else if (derivatives) {
    Linearise(at);
  } else {
    Integrate<double>(at);
  }
}

namespace {

constexpr TimeNs kPathStep = 100'000'000;  // 0.1 s

}  // namespace

std::unique_ptr<Segment> MakeSegment(const DriveTrack& track, const WindowData& data, TimeNs from,
                                     TimeNs to, const ParameterScaling& scaling, double max_block) {
  const TimeNs before = to == data.end ? to + 1 : to;
  std::vector<TimeNs> times{to}, force_times;
  for (const Fix& fix : SamplesBetween(data.fixes, from, before)) times.push_back(fix.t);
  for (const ForceSample& force : SamplesBetween(data.forces, from, before)) {
    force_times.push_back(force.t);
  }
  // An arc without force samples has no nodes of its own: add some for the trajectory plot.
  const bool bare = force_times.empty() && !data.passes.empty();
  for (TimeNs t = bare ? data.passes.back().end : to; t < to; t += kPathStep) {
    if (t >= from) times.push_back(t);
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return std::make_unique<Segment>(track, from, times, force_times, scaling, max_block);
}

std::vector<TimeNs> EvenKnots(TimeNs from, TimeNs to, double interval) {
  const TimeNs length = to - from;
  const int count = std::max(1, static_cast<int>(std::ceil(ToSeconds(length) / interval)));
  std::vector<TimeNs> knots;
  for (int k = 0; k <= count; ++k) knots.push_back(from + length * k / count);
  return knots;
}

// A negligible floor keeps the covariance regular if a process is switched off: 1 mm, 1 mm/s,
// 0.0006 deg.
ContinuityResidual::Weights StepWeights(const ProcessNoise& noise,
                                        const Eigen::Vector3d& drift_unit, const Segment& segment,
                                        double gravity) {
  const double seconds = SecondsBetween(segment.start(), segment.end());
  Matrix9d cov = ProcessCovariance(noise, seconds, gravity, segment.thrust_axis());
  cov.diagonal().head<6>().array() += 1e-6;
  cov.diagonal().tail<3>().array() += 1e-10;
  const Matrix9d L = cov.llt().matrixL();
  return {drift_unit, noise.Decay(seconds),
          L.triangularView<Eigen::Lower>().solve(Matrix9d::Identity()), noise.GustDecay(seconds),
          noise.gust > 0.0 ? 1.0 / noise.GustStepSigma(seconds) : 0.0};
}

double LogDeterminant(const ContinuityResidual::Weights& weights, bool gusts) {
  // Of a triangular matrix.
  const double path = weights.sqrt_information.diagonal().array().log().sum();
  return gusts ? path + kGustSize * std::log(weights.gust_weight) : path;
}

}  // namespace trueline
