#include <algorithm>
#include <cmath>
#include <functional>

#include "cost_functions/models/rotation.h"
#include "problems/effects/effect.h"
#include "problems/vgd/rough_path.h"

namespace trueline {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Context {
  const FlightLog& original;
  const std::vector<VelocitySample>& path;

  double Since(TimeNs t) const { return SecondsBetween(original.imu.front().t, t); }
};

// Removes the angles (phi, theta, psi) of E' against E: q_Ep_E(angles)^-1 q_Ep_I.
void TurnBack(const Vector3d& angles, Quaterniond* q_Ep_I) {
  *q_Ep_I = QuaternionFromEuler<double>(angles) * *q_Ep_I;
}

double HeadingOf(const Quaterniond& q_E_B) {
  const Vector3d forward_E = q_E_B * Vector3d::UnitX();
  return std::atan2(forward_E.y(), forward_E.x());
}

// Attitude at the sample nearest to t; accurate enough to rotate small, slowly varying vectors.
const Quaterniond& AttitudeNear(const FlightLog& log, TimeNs t) {
  const auto after =
      std::lower_bound(log.attitude.begin(), log.attitude.end(), t,
                       [](const AttitudeSample& s, TimeNs value) { return s.t < value; });
  return after == log.attitude.end() ? log.attitude.back().q_Ep_I : after->q_Ep_I;
}

void UndoAccelScale(const Effect& effect, const Context&, FlightLog* log) {
  for (ImuSample& s : log->imu) s.accel.z() /= 1.0 + effect["s"];
}

// Non-orthogonal axes: the thrust axis measures small shares of the other two.
void UndoAccelCrossAxis(const Effect& effect, const Context&, FlightLog* log) {
  for (ImuSample& s : log->imu) {
    s.accel.z() -= effect["l_x"] * s.accel.x() + effect["l_y"] * s.accel.y();
  }
}

void UndoAccelBiasDrift(const Effect& effect, const Context& context, FlightLog* log) {
  for (ImuSample& s : log->imu) s.accel.z() -= effect["d"] * context.Since(s.t);
}

// a at the IMU = a + w x (w x r) + dw/dt x r. The rate is differentiated over 30 ms to suppress
// vibration.
void UndoLeverArm(const Effect& effect, const Context&, FlightLog* log) {
  constexpr double kReach = 0.015;  // s, to either side
  const Vector3d r(effect["r_x"], effect["r_y"], effect["r_z"]);
  std::vector<ImuSample>& imu = log->imu;
  std::size_t before = 0, after = 0;
  for (std::size_t i = 0; i < imu.size(); ++i) {
    while (SecondsBetween(imu[before].t, imu[i].t) > kReach) ++before;
    while (after + 1 < imu.size() && SecondsBetween(imu[i].t, imu[after].t) < kReach) ++after;
    const std::size_t low = std::min(before, i > 0 ? i - 1 : 0), high = std::max(after, i);
    const double span = SecondsBetween(imu[low].t, imu[high].t);
    const Vector3d dw = (imu[high].gyro - imu[low].gyro) / std::max(span, 1e-6);
    const Vector3d& w = imu[i].gyro;
    imu[i].accel -= w.cross(w.cross(r)) + dw.cross(r);
  }
}

// Velocity every quarter of a second by lines and curves through the fixes.
std::vector<VelocitySample> RoughVelocities(const FlightLog& log) {
  std::vector<VelocitySample> path;
  const std::vector<Pass> passes = FindPasses(log.fixes, PassOptions());
  if (passes.empty()) return path;
  const RoughPath rough(log.fixes, passes);
  for (TimeNs t = passes.front().begin; t <= rough.end(); t += FromSeconds(0.25)) {
    path.push_back({t, rough.At(t).v});
  }
  return path;
}

// The tilt of E' follows the low-passed horizontal acceleration with gain k: phi = a_y / g and
// theta = -a_x / g for an acceleration that lasts. Outside of the path the tilt decays.
void UndoAccelerationError(const Effect& effect, const Context& context, FlightLog* log) {
  const std::vector<VelocitySample> rough =
      context.path.empty() ? RoughVelocities(context.original) : std::vector<VelocitySample>();
  const std::vector<VelocitySample>& path = context.path.empty() ? rough : context.path;
  const double k = effect["k"], side = k < 0.0 ? -1.0 : 1.0;
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
  std::size_t i = 0;
  TimeNs last = log->attitude.empty() ? 0 : log->attitude.front().t;
  for (AttitudeSample& s : log->attitude) {
    while (i + 1 < path.size() && path[i + 1].t <= s.t) ++i;
    Vector3d a_E = Vector3d::Zero();
    if (i + 1 < path.size() && s.t >= path[i].t) {
      a_E = (path[i + 1].v_E - path[i].v_E) / SecondsBetween(path[i].t, path[i + 1].t);
    }
    const Eigen::Vector2d apparent = Eigen::Vector2d(a_E.y(), -a_E.x()) / log->gravity;
    tilt -= std::expm1(-std::abs(k) * SecondsBetween(last, s.t)) * (side * apparent - tilt);
    last = s.t;
    TurnBack(Vector3d(tilt.x(), tilt.y(), 0.0), &s.q_Ep_I);
  }
}

// The angle between the body's z axis and down, divided by 1 + s; heading and direction stay.
void UndoTiltScale(const Effect& effect, const Context&, FlightLog* log) {
  for (AttitudeSample& sample : log->attitude) {
    const Vector3d down_I = sample.q_Ep_I * Vector3d::UnitZ();
    const Quaterniond tilt = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), down_I);
    const Eigen::AngleAxisd whole(tilt);
    const Eigen::AngleAxisd part(whole.angle() / (1.0 + effect["s"]), whole.axis());
    sample.q_Ep_I = Quaterniond(part) * tilt.conjugate() * sample.q_Ep_I;
  }
}

void UndoHeadingDrift(const Effect& effect, const Context& context, FlightLog* log) {
  for (AttitudeSample& s : log->attitude) {
    TurnBack(Vector3d(0.0, 0.0, effect["d"] * context.Since(s.t)), &s.q_Ep_I);
  }
}

void UndoHeadingDistortion(const Effect& effect, const Context&, FlightLog* log) {
  for (AttitudeSample& s : log->attitude) {
    const double psi = HeadingOf(s.q_Ep_I);
    const double error = effect["a_sin"] * std::sin(psi) + effect["a_cos"] * std::cos(psi);
    TurnBack(Vector3d(0.0, 0.0, error), &s.q_Ep_I);
  }
}

// A tilt of E' that is fixed in the body and changes slowly over the flight, as a filter's integral
// winds up in turns: angles = first * P1(s) + second * P2(s), s from -1 to 1 over the log.
void UndoBodyTiltDrift(const Effect& effect, const Context& context, FlightLog* log) {
  const double duration = std::max(1e-3, context.Since(log->attitude.back().t));
  for (AttitudeSample& sample : log->attitude) {
    const double s = 2.0 * context.Since(sample.t) / duration - 1.0;
    const double p2 = 1.5 * s * s - 0.5;
    const Vector3d angles(effect["roll_1"] * s + effect["roll_2"] * p2,
                          effect["pitch_1"] * s + effect["pitch_2"] * p2, 0.0);
    sample.q_Ep_I = sample.q_Ep_I * QuaternionFromEuler<double>(angles).conjugate();
  }
}

void UndoAttitudeLatency(const Effect& effect, const Context&, FlightLog* log) {
  for (AttitudeSample& s : log->attitude) s.t -= FromSeconds(effect["tau"]);
}

void UndoFixLatency(const Effect& effect, const Context&, FlightLog* log) {
  for (Fix& fix : log->fixes) {
    if (fix.gate >= 0) fix.t -= FromSeconds(effect["tau"]);
  }
}

// Calls undo(fix, vector in E to the gate) for all fixes of gates of the map.
void ForEachGateVector(FlightLog* log, const std::function<void(Fix*, const Vector3d&)>& undo) {
  for (Fix& fix : log->fixes) {
    const auto gate = std::find_if(log->gates.begin(), log->gates.end(),
                                   [&](const Gate& g) { return g.id == fix.gate; });
    if (gate != log->gates.end()) undo(&fix, gate->position - fix.p_E);
  }
}

void UndoFixScale(const Effect& effect, const Context&, FlightLog* log) {
  ForEachGateVector(
      log, [s = effect["s"]](Fix* fix, const Vector3d& u_E) { fix->p_E += u_E - u_E / (1.0 + s); });
}

void UndoCameraMisalignment(const Effect& effect, const Context& context, FlightLog* log) {
  if (context.original.attitude.empty()) return;
  const Quaterniond turn =
      QuaternionFromEuler<double>(Vector3d(effect["roll"], effect["pitch"], effect["yaw"]));
  ForEachGateVector(log, [&](Fix* fix, const Vector3d& u_E) {
    const Quaterniond& q_E_B = AttitudeNear(context.original, fix->t);
    fix->p_E += u_E - q_E_B * (turn.conjugate() * (q_E_B.conjugate() * u_E));
  });
}

void UndoGateMoved(const Effect& effect, const Context&, FlightLog* log) {
  const Vector3d d(effect["dx"], effect["dy"], effect["dz"]);
  for (Fix& fix : log->fixes) {
    if (fix.gate == static_cast<int>(effect["gate"])) fix.p_E += d;
  }
}

using Undo = void (*)(const Effect&, const Context&, FlightLog*);

// In this order: clocks and IMU first, because later corrections use the corrected samples.
const std::vector<std::pair<std::string, Undo>>& Undoers() {
  static const std::vector<std::pair<std::string, Undo>> undoers = {
      {"attitude_latency", UndoAttitudeLatency},
      {"accel_scale_z", UndoAccelScale},
      {"accel_bias_drift", UndoAccelBiasDrift},
      {"imu_lever_arm", UndoLeverArm},
      {"accel_cross_axis", UndoAccelCrossAxis},
      {"ahrs_acceleration_error", UndoAccelerationError},
      {"body_tilt_drift", UndoBodyTiltDrift},
      {"tilt_scale", UndoTiltScale},
      {"heading_drift", UndoHeadingDrift},
      {"heading_distortion", UndoHeadingDistortion},
      {"gate_moved", UndoGateMoved},
      {"fix_scale", UndoFixScale},
      {"camera_misalignment", UndoCameraMisalignment},
      {"fix_latency", UndoFixLatency}};
  return undoers;
}

bool IsForce(const std::string& id) {
  return id == "quadratic_drag" || id == "rotor_drag" || id == "wind" || id == "drag_step";
}

}  // namespace

ForceEffects ForceEffectsOf(const std::vector<Effect>& effects) {
  ForceEffects force;
  for (const Effect& effect : effects) {
    if (effect.id == "quadratic_drag") force.quadratic_drag += effect["c"];
    if (effect.id == "rotor_drag") force.rotor_drag += effect["k"];
    if (effect.id == "wind") force.wind_E += Vector3d(effect["w_x"], effect["w_y"], 0.0);
    if (effect.id == "drag_step") {
      force.step_time = effect["t_step"];
      force.step_factor = effect["factor"];
    }
  }
  return force;
}

FlightLog CorrectLog(const FlightLog& log, const std::vector<Effect>& effects,
                     const std::vector<VelocitySample>& path) {
  FlightLog corrected = log;
  const Context context{log, path};
  for (const auto& [id, undo] : Undoers()) {
    for (const Effect& effect : effects) {
      if (effect.id == id) undo(effect, context, &corrected);
    }
  }
  return corrected;
}

bool IsModelled(const std::string& effect_id) {
  const auto& undoers = Undoers();
  // Handled by the estimator's robust loss.
  if (effect_id == "false_gate") return true;
  return IsForce(effect_id) || std::any_of(undoers.begin(), undoers.end(), [&](const auto& undo) {
           return undo.first == effect_id;
         });
}

}  // namespace trueline
