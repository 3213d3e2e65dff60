// A log whose attitude and accelerometer are smooth functions of time, and independent integration
// of eq. 15 along a drive: rotations by quaternions, one step for each entry of the track.
#pragma once

#include "problems/vgd/drive_track.h"
#include "problems/vgd/segment.h"

namespace trueline::testing_window {

inline Eigen::Quaterniond AttitudeAt(double t) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return AngleAxisd(0.8 * t, Vector3d::UnitZ()) *
         AngleAxisd(0.3 * std::sin(1.7 * t), Vector3d::UnitY()) *
         AngleAxisd(0.4 * std::sin(1.1 * t + 0.4), Vector3d::UnitX());
}
inline double ThrustAt(double t) { return -10.5 - 1.5 * std::sin(2.3 * t); }

inline FlightLog FlownLog(double seconds, double rate = 400.0) {
  FlightLog log;
  log.directory = "flown";
  for (int i = 0; i <= std::lround(seconds * rate); ++i) {
    const double t = i / rate;
    log.imu.push_back({FromSeconds(t), {0.1, -0.2, ThrustAt(t)}, Eigen::Vector3d::Zero()});
    log.attitude.push_back({FromSeconds(t), AttitudeAt(t)});
  }
  return log;
}

struct Motion {
  Eigen::Vector3d p, v;
};

// The parameters of a segment in their own units: theta scaled, with the drift on the AHRS error.
inline Eigen::Matrix<double, kThetaSize, 1> Physical(const ParameterScaling& scaling,
                                                     const double* theta, const double* drift) {
  Eigen::Matrix<double, kThetaSize, 1> x;
  for (int i = 0; i < kThetaSize; ++i) {
    const bool ahrs = kTheta[i].group == ParameterGroup::kAhrsError;
    const double added = ahrs ? drift[i - kAhrsInTheta] : 0.0;
    x[i] = scaling.mean[i] + scaling.sigma[i] * (theta[i] + added);
  }
  return x;
}

inline Eigen::Quaterniond Turn(double phi, double theta, double psi) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return AngleAxisd(psi, Vector3d::UnitZ()) * AngleAxisd(theta, Vector3d::UnitY()) *
         AngleAxisd(phi, Vector3d::UnitX());
}

// dv_E/dt by eq. 6-9, with the thrust that makes the accelerometer's z axis read a_z - b_az.
template <class Parameters>
Eigen::Vector3d Acceleration(const Parameters& x, const Drive& drive, const Eigen::Vector3d& v_E) {
  constexpr int kE = InTheta("phi_E_Ep"), kI = InTheta("phi_I_B");
  const Eigen::Quaterniond q_E_B = Turn(x[kE], x[kE + 1], x[kE + 2]) *
                                   Eigen::Quaterniond(drive.R_Ep_I) *
                                   Turn(x[kI], x[kI + 1], x[kI + 2]);
  const Eigen::Vector3d v_B = q_E_B.conjugate() * v_E;
  const Eigen::Vector3d z_I =
      Turn(x[kI], x[kI + 1], x[kI + 2]).conjugate() * Eigen::Vector3d::UnitZ();
  Eigen::Vector3d f_B(x[InTheta("K_x")] * v_B.x(), x[InTheta("K_y")] * v_B.y(), 0.0);
  f_B.z() = (drive.a_z - x[InTheta("b_az")] - z_I.dot(f_B)) / z_I.z();
  return q_E_B * f_B + Eigen::Vector3d(0, 0, 9.81);
}

// Heun's steps along the track from `start` to `end`.
template <class Parameters>
Motion Integrate(const DriveTrack& track, const Parameters& x, Motion motion, TimeNs start,
                 TimeNs end) {
  for (const DriveStep& step : track.steps()) {
    const TimeNs from = std::max(step.t, start), to = std::min(step.t + FromSeconds(step.dt), end);
    if (to <= from) continue;
    const double h = SecondsBetween(from, to);
    const Eigen::Vector3d a1 = Acceleration(x, step.drive, motion.v);
    const Eigen::Vector3d a2 = Acceleration(x, step.drive, motion.v + a1 * h);
    motion.p += motion.v * h + 0.25 * h * h * (a1 + a2);
    motion.v += 0.5 * h * (a1 + a2);
  }
  return motion;
}

inline Motion Integrate(const DriveTrack& track, const ParameterScaling& scaling,
                        const double* theta, const double* drift, const double* state, TimeNs start,
                        TimeNs end) {
  const Motion from{Eigen::Vector3d(state[0], state[1], state[2]),
                    Eigen::Vector3d(state[3], state[4], state[5])};
  return Integrate(track, Physical(scaling, theta, drift), from, start, end);
}

// The reading of an accelerometer along I's axes from drag and bias at `t`, by eq. 7-9.
inline Eigen::Vector3d ForceInImu(const DriveTrack& track, const ParameterScaling& scaling,
                                  const double* theta, const double* drift, const double* state,
                                  TimeNs start, TimeNs t) {
  const auto x = Physical(scaling, theta, drift);
  const Motion motion = Integrate(track, scaling, theta, drift, state, start, t);
  const Drive& drive = track.steps()[track.StepAt(t)].drive;
  const Eigen::Vector3d a = Acceleration(x, drive, motion.v) - Eigen::Vector3d(0, 0, 9.81);
  constexpr int kE = InTheta("phi_E_Ep");
  const Eigen::Quaterniond q_E_I =
      Turn(x[kE], x[kE + 1], x[kE + 2]) * Eigen::Quaterniond(drive.R_Ep_I);
  return q_E_I.conjugate() * a + Eigen::Vector3d(x[InTheta("b_ax")], x[InTheta("b_ay")], 0.0);
}

}  // namespace trueline::testing_window
