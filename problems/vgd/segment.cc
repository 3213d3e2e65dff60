#include "problems/vgd/segment.h"

#include <ceres/jet.h>
#include <glog/logging.h>

#include <algorithm>

namespace trueline {
namespace {

// Columns of the integration's derivatives: the parameters of eq. 16 and the initial velocity. The
// initial position only adds, and the accelerometer's biases b_ax and b_ay do not affect the
// motion, so their derivatives are known.
constexpr int kSeeds = kMotionSize + 3;
using Jet = ceres::Jet<double, kSeeds>;

template <int kSize>
void SplitDerivatives(const Eigen::Matrix<double, kSize, kSeeds>& d, SegmentNode<kSize>* node) {
  node->d_theta.template leftCols<kMotionSize>() = d.template leftCols<kMotionSize>();
  node->d_state.template rightCols<3>() = d.template rightCols<3>();
}

void Store(const Vector3<double>& p, const Vector3<double>& v, StateNode* node) {
  node->value << p, v;
}

void Store(const Vector3<Jet>& p, const Vector3<Jet>& v, StateNode* node) {
  Eigen::Matrix<double, 6, kSeeds> d;
  for (int i = 0; i < 3; ++i) {
    node->value[i] = p[i].a;
    node->value[i + 3] = v[i].a;
    d.row(i) = p[i].v.transpose();
    d.row(i + 3) = v[i].v.transpose();
  }
  SplitDerivatives(d, node);
  node->d_state.topLeftCorner<3, 3>().setIdentity();
}

void Store(const Vector3<double>& f_I, const double* b_a, ForceNode* node) {
  node->value << f_I[0] + b_a[0], f_I[1] + b_a[1];
}

void Store(const Vector3<Jet>& f_I, const double* b_a, ForceNode* node) {
  Eigen::Matrix<double, 2, kSeeds> d;
  for (int i = 0; i < 2; ++i) {
    node->value[i] = f_I[i].a + b_a[i];
    d.row(i) = f_I[i].v.transpose();
  }
  SplitDerivatives(d, node);
}

// Mean thrust around t: single samples contain vibration, and noise in this factor would attenuate
// drag.
double MeanThrust(const DriveTrack& track, TimeNs t) {
  constexpr double kThrustReach = 0.05;  // s, to either side
  const auto& steps = track.steps();
  const std::size_t middle = track.StepAt(t);
  std::size_t first = middle, last = middle;
  while (first > 0 && SecondsBetween(steps[first - 1].t, t) <= kThrustReach) --first;
  while (last + 1 < steps.size() && SecondsBetween(t, steps[last + 1].t) <= kThrustReach) ++last;
  double sum = 0.0;
  for (std::size_t i = first; i <= last; ++i) sum -= steps[i].drive.a_z;
  return sum / static_cast<double>(last - first + 1);
}

// Specific force in I by eq. 7-9 from the velocity in E'.
// `thrust` in m/s^2, `t` in s from the log's start.
template <typename T>
Vector3<T> ForceInImu(const ImuDrivenModel<T>& model, const ForceEffects& effects,
                      const Drive& drive, const Vector3<T>& v_Ep, double thrust, double t) {
  const Eigen::Matrix3d R_I_Ep = drive.R_Ep_I.transpose();
  const Vector3<T> v_B = model.R_B_I() * Times(R_I_Ep, v_Ep);
  Vector3<T> f_B = model.SpecificForce(drive.a_z, v_B);
  if (effects.Any()) {
    const Vector3<T> wind_Ep = model.R_Ep_E() * effects.wind_E.template cast<T>();
    const Vector3<T> wind_B = model.R_B_I() * Times(R_I_Ep, wind_Ep);
    const auto& p = model.parameters();
    f_B += effects.AddedForce(p.K_x, p.K_y, v_B, wind_B, thrust, t);
  }
  return model.R_B_I().transpose() * f_B;
}

}  // namespace

ParameterScaling::ParameterScaling(const VgdOptions& options) {
  for (int i = 0; i < kThetaSize; ++i) {
    mean[i] = options.PriorOf(i).mean;
    sigma[i] = options.PriorOf(i).sigma;
  }
}

Segment::Segment(const DriveTrack& track, TimeNs start, std::vector<TimeNs> times,
                 const std::vector<TimeNs>& force_times, const ParameterScaling& scaling,
                 double max_block)
    : chain_(track, start, std::move(times), max_block),
      scaling_(&scaling),
      gravity_(track.gravity()),
      effects_(track.force_effects()),
      states_(chain_.times().size()) {
  for (const TimeNs t : force_times) {
    forces_.push_back({IndexOf(t), SecondsBetween(track.log_start(), t),
                       track.steps()[track.StepAt(t)].drive, MeanThrust(track, t), ForceNode()});
    forces_.back().node.d_theta.rightCols<2>() =
        Eigen::Vector2d(scaling.sigma.tail<2>()).asDiagonal();
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
  const auto it = std::lower_bound(
      forces_.begin(), forces_.end(), index,
      [](const Force& force, std::size_t value) { return force.time_index < value; });
  CHECK(it != forces_.end() && it->time_index == index);
  return *it;
}

const ForceNode* Segment::ForceAt(TimeNs t) const { return &FindForce(t).node; }

Eigen::Matrix<double, 6, 4> Segment::StateGustsAt(TimeNs t) const {
  return StateByGusts(SecondsBetween(start(), t), SecondsBetween(start(), end()));
}

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
    states_[i].value += StateGustsAt(times()[i]) * gusts;
  }
  for (Force& force : forces_) force.node.value += ForceByGusts(force) * gusts;
}

template <typename T>
void Segment::Integrate(const ImuDrivenParameters<T>& parameters, const MotionState<T>& start,
                        const double* b_a) {
  const ImuDrivenModel<T> model(parameters, gravity_);
  auto force = forces_.begin();
  const auto visit = [&](std::size_t i, const MotionState<T>& x, const Vector3<T>& v_Ep) {
    Store(x.p, x.v, &states_[i]);
    if (force == forces_.end() || force->time_index != i) return;
    Store(ForceInImu(model, effects_, force->drive, v_Ep, force->thrust, force->t), b_a,
          &force->node);
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
  const Eigen::Matrix<double, kThetaSize, 1> moved =
      scaling_->sigma.cwiseProduct(at.theta - linearised_at_->theta).cwiseAbs();
  const Eigen::Vector3d v = at.state.tail<3>() - linearised_at_->state.tail<3>();
  for (int i = 0; i < kMotionSize; ++i) {
    if (!(moved[i] < NearOf(kTheta[i].group))) return false;
  }
  return v.cwiseAbs().maxCoeff() < kVelocity;
}

void Segment::Extrapolate(const Inputs& to) {
  const Eigen::Matrix<double, kThetaSize, 1> theta = to.theta - linearised_at_->theta;
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
  const Eigen::Matrix<double, kThetaSize, 1> x =
      scaling_->mean + scaling_->sigma.cwiseProduct(at.theta);
  Jet jets[kMotionSize];
  for (int i = 0; i < kMotionSize; ++i) {
    jets[i] = Jet(x[i]);
    jets[i].v[i] = scaling_->sigma[i];
  }
  MotionState<Jet> start;
  for (int i = 0; i < 3; ++i) {
    start.p[i] = Jet(at.state[i]);
    start.v[i] = Jet(at.state[3 + i], kMotionSize + i);
  }
  Integrate(ImuDrivenParameters<Jet>::FromArray(jets), start, x.data() + kMotionSize);
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
  at.theta.segment<kDriftSize>(kAhrsInTheta) += Eigen::Map<const Eigen::Vector3d>(drift);
  if (IsNear(at)) {
    Extrapolate(at);
  } else if (derivatives) {
    Linearise(at);
  } else {
    const Eigen::Matrix<double, kThetaSize, 1> x =
        scaling_->mean + scaling_->sigma.cwiseProduct(at.theta);
    const MotionState<double> start{at.state.head<3>(), at.state.tail<3>()};
    Integrate(ImuDrivenParameters<double>::FromArray(x.data()), start, x.data() + kMotionSize);
  }
}

}  // namespace trueline
