#include "problems/simulation/trajectory_tracker.h"

#include <algorithm>
#include <cmath>

namespace trueline::simulation {
namespace {

// R_E_B as a quaternion: -z_B along the wanted `thrust_E`, the nose above or below `heading` (rad),
// as trajectories state it (rotations about z, then y, then x; problems/trajectory/rotor_flight.h).
Quaterniond NoseTowards(const Vector3d& thrust_E, double heading) {
  const Vector3d z = -thrust_E.normalized();
  const Vector3d x = Vector3d(-std::sin(heading), std::cos(heading), 0.0).cross(z).normalized();
  Eigen::Matrix3d R_E_B;
  R_E_B << x, z.cross(x), z;
  return Quaterniond(R_E_B);
}

}  // namespace

TrajectoryTracker::TrajectoryTracker(const RotorFlight& flight, double gravity, double step,
                                     double min_speed, double max_speed, double lag,
                                     const TrackerGains& gains)
    : vehicle_(flight.vehicle()),
      gravity_(gravity),
      min_speed_(min_speed),
      max_speed_(max_speed),
      lead_(static_cast<int>(std::lround(lag / step))),
      gains_(gains) {
  const int steps = static_cast<int>(std::floor(flight.path().duration() / step + 1e-9));
  wanted_.reserve(steps + 1);
  for (int k = 0; k <= steps; ++k) {
    wanted_.push_back(Sample(flight, flight.path().start() + k * step));
  }
  for (int k = 0; k <= steps; ++k) {
    const int before = std::max(0, k - 1), after = std::min(steps, k + 1);
    wanted_[k].dw_B = (wanted_[after].w_B - wanted_[before].w_B) / ((after - before) * step);
  }
}

TrajectoryTracker::Wanted TrajectoryTracker::Sample(const RotorFlight& flight, double t) {
  using Model = RotorDrivenModel;
  const NominalPoint point = flight.At(t);
  const double* x = point.x.data();
  const FlatMatrix flat = flight.path().Expand(t, 2);
  Wanted wanted;
  wanted.p_E = Eigen::Map<const Vector3d>(x + Model::kPosition);
  wanted.v_E = Eigen::Map<const Vector3d>(x + Model::kVelocity);
  wanted.a_E = 2.0 * flat.block<3, 1>(0, 2);
  wanted.q_E_B = Quaterniond(x[0], x[1], x[2], x[3]);
  wanted.w_B = Eigen::Map<const Vector3d>(x + Model::kRate);
  wanted.yaw = flat(3, 0);
  wanted.rotors.resize(static_cast<Eigen::Index>(point.u.size()));
  for (std::size_t i = 0; i < point.u.size(); ++i) {
    wanted.rotors[i] = std::sqrt(std::max(point.u[i], 0.0));
  }
  return wanted;
}

BodyState TrajectoryTracker::Start() const {
  const Wanted& first = wanted_.front();
  BodyState state;
  state.p_E = first.p_E;
  state.v_E = first.v_E;
  state.q_E_B = first.q_E_B.coeffs();
  state.w_B = first.w_B;
  state.rotors = first.rotors;
  return state;
}

// Where a rotor would saturate, the yaw moment is reduced first, as in usual flight controllers:
// yaw takes much of the rotors' range, and the vehicle can fly without yaw control but not without
// roll and pitch.
RotorArray TrajectoryTracker::SpeedsFor(double thrust, const Vector3d& moment) const {
  const double low = min_speed_ * min_speed_, high = max_speed_ * max_speed_;
  RotorArray squared;
  for (const double yaw : {1.0, 0.8, 0.6, 0.4, 0.2, 0.0}) {
    const Eigen::Vector4d wrench(thrust, moment.x(), moment.y(), yaw * moment.z());
    squared = (vehicle_.speeds_from_wrench * wrench).array();
    if (squared.minCoeff() >= low && squared.maxCoeff() <= high) break;
  }
  return squared.max(low).min(high).sqrt();
}

RotorArray TrajectoryTracker::Command(int k, const BodyState& state) const {
  const Wanted& wanted = wanted_[k];
  // The reference is read ahead by the rotors' lag.
  const Wanted& ahead = wanted_[std::min(k + lead_, num_steps())];
  const Vector3d thrust_E = wanted.a_E + gains_.position * (wanted.p_E - state.p_E) +
                            gains_.velocity * (wanted.v_E - state.v_E) -
                            Vector3d(0.0, 0.0, gravity_);
  const Quaterniond q_E_B = state.Attitude();
  const Quaterniond q_B_wanted = q_E_B.conjugate() * NoseTowards(thrust_E, wanted.yaw);
  const Quaterniond q_B_reference = q_E_B.conjugate() * wanted.q_E_B;
  const Vector3d w = q_B_reference * wanted.w_B + gains_.attitude * SmallTurn(q_B_wanted);
  const Vector3d dw = q_B_reference * ahead.dw_B + gains_.rate * (w - state.w_B);
  const Vector3d momentum = vehicle_.inertia.cwiseProduct(state.w_B);
  return SpeedsFor(
      -vehicle_.mass * (thrust_E + ahead.a_E - wanted.a_E).dot(q_E_B * Vector3d::UnitZ()),
      vehicle_.inertia.cwiseProduct(dw) + state.w_B.cross(momentum));
}

}  // namespace trueline::simulation
