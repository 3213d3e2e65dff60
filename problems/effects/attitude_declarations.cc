// The declarations of errors of the attitude filter (Li et al. 2019, eq. 15).
#include <algorithm>
#include <cmath>

#include "cost_functions/models/rotation.h"
#include "problems/effects/declaration.h"
#include "problems/vgd/attitude_errors.h"

namespace trueline {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Removes the angles (phi, theta, psi) of E' against E: q_Ep_E(angles)^-1 q_Ep_I.
void TurnBack(const Vector3d& angles, Quaterniond* q_Ep_I) {
  *q_Ep_I = QuaternionFromEuler<double>(angles) * *q_Ep_I;
}

double HeadingOf(const Quaterniond& q_E_B) {
  const Vector3d forward_E = q_E_B * Vector3d::UnitX();
  return std::atan2(forward_E.y(), forward_E.x());
}

// Calls `tilt(v_E, a_E, dt)` at each attitude, with velocity and acceleration of the path (zero
// outside of it) and the time since the last one, and removes the angles of E' that it returns.
template <class Tilt>
void UndoTiltAlong(const std::vector<VelocitySample>& path, FlightLog* log, Tilt&& tilt) {
  std::size_t i = 0;
  TimeNs last = log->attitude.empty() ? 0 : log->attitude.front().t;
  for (AttitudeSample& s : log->attitude) {
    while (i + 1 < path.size() && path[i + 1].t <= s.t) ++i;
    Vector3d v_E = Vector3d::Zero(), a_E = Vector3d::Zero();
    if (i + 1 < path.size() && s.t >= path[i].t) {
      a_E = (path[i + 1].v_E - path[i].v_E) / SecondsBetween(path[i].t, path[i + 1].t);
      v_E = path[i].v_E + a_E * SecondsBetween(path[i].t, s.t);
    }
    const Eigen::Vector2d angles = tilt(v_E, a_E, SecondsBetween(last, s.t));
    last = s.t;
    TurnBack(Vector3d(angles.x(), angles.y(), 0.0), &s.q_Ep_I);
  }
}

// The tilt (phi, theta) of E' at which gravity looks turned by a horizontal acceleration.
Eigen::Vector2d ApparentTilt(const Vector3d& a_E, double gravity) {
  return Eigen::Vector2d(a_E.y(), -a_E.x()) / gravity;
}

// The tilt of E' follows the low-passed horizontal acceleration with gain k. Outside of the path it
// decays.
void UndoAccelerationError(const Effect& effect, const CorrectionContext& context, FlightLog* log) {
  const double k = effect["k"], side = k < 0.0 ? -1.0 : 1.0;
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
  UndoTiltAlong(context.Path(), log, [&](const Vector3d&, const Vector3d& a_E, double dt) {
    tilt -= std::expm1(-std::abs(k) * dt) * (side * ApparentTilt(a_E, log->gravity) - tilt);
    return tilt;
  });
}

// A filter that fuses positions and knows no drag takes what drag does to the path for a tilt: that
// of the deceleration k v, through the second-order low-pass of its position loop.
void UndoDragError(const Effect& effect, const CorrectionContext& context, FlightLog* log) {
  constexpr double kLoop = 2.0, kDamping = 0.7;  // rad/s, of a Crazyflie's filter: 1.5 to 3; 1
  constexpr double kLongestStep = 0.05;          // s, of the integration, also over a gap
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero(), rate = Eigen::Vector2d::Zero();
  UndoTiltAlong(context.Path(), log, [&](const Vector3d& v_E, const Vector3d&, double dt) {
    const Eigen::Vector2d apparent = ApparentTilt(effect["k"] * v_E, log->gravity);
    const double all = std::min(dt, 10.0 / kLoop);  // of a long gap the end counts
    const int steps = static_cast<int>(std::ceil(all / kLongestStep));
    const double h = all / steps;
    for (int i = 0; i < steps; ++i) {
      rate += h * (kLoop * kLoop * (apparent - tilt) - 2.0 * kDamping * kLoop * rate);
      tilt += h * rate;
    }
    return tilt;
  });
}

void TurnBy(const Vector3d& angles_Ep, AttitudeSample* sample) {
  sample->q_Ep_I = RotationByVector(angles_Ep) * sample->q_Ep_I;
}

// The angle between the body's z axis and down, less s times the true one; heading and direction
// stay. The true angle is the logged one over 1 + s, without the noise that the gyroscope shows.
void UndoTiltScale(const Effect& effect, const CorrectionContext&, FlightLog* log) {
  const double s = effect["s"];
  std::vector<AttitudeSample> divided = log->attitude;
  for (AttitudeSample& sample : divided) TurnBy(-s / (1.0 + s) * TiltOf(sample.q_Ep_I), &sample);
  const std::vector<AttitudeSample> truth = SmoothAttitude(log->imu, divided);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    TurnBy(-s * TiltOf(truth[i].q_Ep_I), &log->attitude[i]);
  }
}

void UndoHeadingDrift(const Effect& effect, const CorrectionContext& context, FlightLog* log) {
  for (AttitudeSample& s : log->attitude) {
    TurnBack(Vector3d(0.0, 0.0, effect["d"] * context.Since(s.t)), &s.q_Ep_I);
  }
}

void UndoHeadingDistortion(const Effect& effect, const CorrectionContext&, FlightLog* log) {
  for (AttitudeSample& s : log->attitude) {
    const double psi = HeadingOf(s.q_Ep_I);
    const double error = effect["a_sin"] * std::sin(psi) + effect["a_cos"] * std::cos(psi);
    TurnBack(Vector3d(0.0, 0.0, error), &s.q_Ep_I);
  }
}

// A tilt of E' that is fixed in the body and changes slowly over the flight, as a filter's integral
// winds up in turns: angles = first * P1(s) + second * P2(s), s from -1 to 1 over the log.
void UndoBodyTiltDrift(const Effect& effect, const CorrectionContext& context, FlightLog* log) {
  if (log->attitude.empty()) return;
  const double duration = std::max(1e-3, context.Since(log->attitude.back().t));
  for (AttitudeSample& sample : log->attitude) {
    const double s = 2.0 * context.Since(sample.t) / duration - 1.0;
    const double p2 = 1.5 * s * s - 0.5;
    const Vector3d angles(effect["roll_1"] * s + effect["roll_2"] * p2,
                          effect["pitch_1"] * s + effect["pitch_2"] * p2, 0.0);
    sample.q_Ep_I = sample.q_Ep_I * QuaternionFromEuler<double>(angles).conjugate();
  }
}

void UndoAttitudeLatency(const Effect& effect, const CorrectionContext&, FlightLog* log) {
  for (AttitudeSample& s : log->attitude) s.t -= FromSeconds(effect["tau"]);
}

}  // namespace

std::vector<EffectInfo> AttitudeDeclarations() {
  using enum EntersAt;
  return {
      {
          .id = "ahrs_acceleration_error",
          .enters = kAttitude,
          .parameters = {{"k", "1/s", 0.1, 3.0, 0.03, false}},
          .physics =
              "the attitude filter mistakes acceleration for gravity, so its tilt error follows it",
          .definition =
              "the tilt of E' follows the horizontal acceleration through a low-pass of gain k",
          .separate_by = "hold an acceleration for several seconds, and then a speed",
          .drawn = {{"k", 0.2, 1.5}},
          .correct_at = CorrectionStage::kAttitude,
          .correct = UndoAccelerationError,
          .replaces = &AttitudeErrorPriors::gain,
      },
      {
          .id = "ahrs_drag_error",
          .enters = kAttitude,
          .parameters = {{"k", "1/s", 0.1, 1.0, 0.03, false}},
          .physics = "the attitude filter fuses positions without a model of drag, so it takes the "
                     "effect of drag for tilt",
          .definition = "the tilt of E' follows that of the deceleration k v through a low-pass of "
                        "2 rad/s",
          .separate_by = "speed up and slow down within a second, and fly fast for several seconds",
          .drawn = {{"k", 0.1, 0.6}},
          .correct_at = CorrectionStage::kAttitude,
          .correct = UndoDragError,
      },
      {
          .id = "body_tilt_drift",
          .enters = kAttitude,
          .parameters = {{"roll_1", "rad", 0.01, 0.1, 0.01},
                         {"pitch_1", "rad", 0.01, 0.1, 0.01},
                         {"roll_2", "rad", 0.01, 0.1, 0.01},
                         {"pitch_2", "rad", 0.01, 0.1, 0.01}},
          .physics = "the attitude filter's integral winds up in turns",
          .definition =
              "tilt error in body axes = first P1(s) + second P2(s), s from -1 to 1 over the log",
          .role = Role::kNuisance,
          .correct_at = CorrectionStage::kAttitude,
          .correct = UndoBodyTiltDrift,
      },
      {
          .id = "tilt_scale",
          .enters = kAttitude,
          .parameters = {{"s", "1", 0.01, 0.5, 0.01}},
          .physics = "the attitude filter states a tilt that is too large by a constant factor",
          .definition = "logged tilt = (1 + s) times the true tilt",
          .separate_by = "turn hard between gates whose distance from each other is known well",
          .correct_at = CorrectionStage::kAttitude,
          .correct = UndoTiltScale,
          .replaces = &AttitudeErrorPriors::share,
      },
      {
          .id = "heading_drift",
          .enters = kAttitude,
          .parameters = {{"d", "rad/s", 0.001, 0.05, 2.5e-4}},
          .physics = "the heading of the attitude filter drifts: a gyro bias about z",
          .definition = "psi of E' against E grows with d t",
          .separate_by = "repeat the first lap at the end",
          .drifts = true,
          .drawn = {{"d", 0.001, 0.01, true}},
          .correct_at = CorrectionStage::kAttitude,
          .correct = UndoHeadingDrift,
          .of_one_flight = true,
      },
      {
          .id = "heading_distortion",
          .enters = kAttitude,
          .parameters = {{"a_sin", "rad", 0.01, 0.5, 0.006}, {"a_cos", "rad", 0.01, 0.5, 0.006}},
          .physics = "magnetic fields of the vehicle deflect the compass by an angle that depends "
                     "on heading",
          .definition = "psi error = a_sin sin(psi) + a_cos cos(psi)",
          .separate_by = "pass gates of many headings",
          .drawn = {{"a_sin", 0.03, 0.25, true}, {"a_cos", 0.03, 0.25, true}},
          .correct_at = CorrectionStage::kAttitude,
          .correct = UndoHeadingDistortion,
      },
      {
          .id = "attitude_latency",
          .enters = kAttitude,
          .parameters = {{"tau", "s", 0.005, 0.2, 0.003, false}},
          .physics = "the logged attitude is older than its stamp",
          .definition = "the logged attitude is that of t - tau",
          .separate_by = "roll and pitch quickly",
          .drawn = {{"tau", 0.02, 0.16}},
          .correct_at = CorrectionStage::kClock,
          .correct = UndoAttitudeLatency,
      },
  };
}

}  // namespace trueline
