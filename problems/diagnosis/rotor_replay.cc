// Open-loop replays of the rotor-driven model: from a fitted state, rotor speeds alone.
#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/diagnosis/misfit.h"
#include "problems/diagnosis/rotor_flight.h"
#include "problems/rotor/rotor_step.h"

namespace trueline {
namespace {

constexpr double kHorizons[] = {0.25, 0.5, 1.0, 2.0};  // s
constexpr double kReplaySpacing = 0.1;                 // s, between starts

// The pose nearest to t.
std::size_t NearestPose(const RotorData& data, double t) {
  const auto& poses = data.poses;
  const auto after = std::ranges::lower_bound(poses, t, {}, &RotorPose::t);
  if (after == poses.begin()) return 0;
  const auto nearest =
      after == poses.end() || t - std::prev(after)->t < after->t - t ? std::prev(after) : after;
  return static_cast<std::size_t>(nearest - poses.begin());
}

}  // namespace

std::vector<ReplayError> RotorDrivenFlight::ReplayOpenLoop() const {
  RotorData data = *fit_.setup->data;
  const double spacing =
      (data.poses.back().t - data.poses.front().t) / static_cast<double>(data.poses.size() - 1);
  const double gap = std::max(0.05, 0.6 * spacing);  // s, between the horizon and the nearest pose
  if (data.motors) data.SimulateMotors(MotorsOf(fit_.batch.mean));
  std::vector<ReplayError> errors;
  double next = data.poses.front().t;
  for (std::size_t i = 0; i < data.poses.size(); ++i) {
    double from = data.poses[i].t;
    if (from < next) continue;
    next = from + kReplaySpacing;
    RotorState x = Joined(fit_.batch.nodes[i].motion, fit_.batch.mean);
    Eigen::Vector3d drift = fit_.batch.nodes[i].drift;
    const Eigen::Vector3d p_E = SensedPosition(x);
    for (const double horizon : kHorizons) {
      const double asked = data.poses[i].t + horizon;
      if (asked > data.poses.back().t) break;
      const RotorPose& pose = data.poses[NearestPose(data, asked)];
      if (pose.t <= from || std::abs(pose.t - asked) > gap) continue;
      x = Integrated(fit_.setup->model, data, options_.noise, x, &drift, from, pose.t);
      from = pose.t;
      const Eigen::Vector3d error_E = SensedPosition(x) - p_E - (pose.p_E - data.poses[i].p_E);
      errors.push_back({static_cast<int>(i), horizon, data.origin + FromSeconds(pose.t), error_E,
                        AttitudeOf(x).transpose() * error_E});
    }
  }
  return errors;
}

std::string RotorDrivenFlight::ReplaysAgainst() const { return "poses"; }

ReplaySituation RotorDrivenFlight::SituationOf(const ReplayError& replay) const {
  constexpr double kNotLogged = std::numeric_limits<double>::quiet_NaN();
  const RotorData& data = *fit_.setup->data;
  const double t = SecondsBetween(data.origin, replay.end) - 0.5 * replay.horizon;
  const std::size_t i = NearestPose(data, t);
  const RotorState x = Joined(fit_.batch.nodes[i].motion, fit_.batch.mean);
  const Eigen::Matrix3d R_E_B = AttitudeOf(x);
  const Eigen::Vector3d f_B = fit_.setup->model.BodyAccelerationOf(x.data(), data.InputAt(t)).force;
  const Eigen::Vector3d p_E = SensedPosition(x);
  ReplaySituation at{};
  at.time = data.since_start + t;
  at.speed = x.segment<3>(RotorDrivenModel::kVelocity).norm();
  at.acceleration = (R_E_B * f_B + log_.gravity * Eigen::Vector3d::UnitZ()).norm();
  at.thrust = -f_B.z();
  at.rate = x.segment<3>(RotorDrivenModel::kRate).norm();
  at.heading = Heading(R_E_B);
  at.gate = -1;
  at.gate_distance = kNotLogged;
  at.height = -p_E.z();
  at.battery = LastBefore(log_.battery, data.origin + FromSeconds(t));
  at.north = p_E.x();
  at.east = p_E.y();
  return at;
}

}  // namespace trueline
