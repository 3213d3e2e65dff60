// The state of the rotor-driven estimators and its minimal error: attitude errors in body axes,
// q = q0 (1, theta / 2), then one number for each state (RotorAeroModel); and the noise that they
// assume.
#pragma once

#include <ceres/jet.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "cost_functions/models/rotor_aero_model.h"
#include "problems/common/yaml_archive.h"

namespace trueline {

using RotorState = Eigen::Matrix<double, RotorAeroModel::kStates, 1>;
using RotorError = Eigen::Matrix<double, RotorAeroModel::kErrors, 1>;
using RotorErrorMatrix = Eigen::Matrix<double, RotorAeroModel::kErrors, RotorAeroModel::kErrors>;
using RotorConstants = Eigen::Matrix<double, RotorAeroModel::kConstants, 1>;
using MovingState = Eigen::Matrix<double, RotorAeroModel::kMoving, 1>;
// What is estimated at one time: the moving state, and an angular acceleration that lasts
// (RotorNoise::angular_drift). Its error is that of the moving state, then of the drift.
struct RotorNode {
  MovingState motion = MovingState::Zero();
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();  // rad/s^2, body axes

  bool operator==(const RotorNode&) const = default;
};
inline constexpr int kDriftError = RotorAeroModel::kMovingErrors;
inline constexpr int kNodeErrors = kDriftError + 3;
using RotorNodeError = Eigen::Matrix<double, kNodeErrors, 1>;
// The places of the mass and of I_x, I_y, I_z among the constants.
inline constexpr int kMassConstant = RotorDrivenModel::kMass - RotorDrivenModel::kMoving;
inline constexpr int kInertiaConstants = RotorDrivenModel::kInertia - RotorDrivenModel::kMoving;
using RotorJet = ceres::Jet<double, RotorAeroModel::kErrors>;

// `x` moved by a finite error; the quaternion stays of unit length.
RotorState Plus(const RotorState& x, const RotorError& error);
// The error e with Plus(a, e) = b (attitude: 2 vec(q_a^* q_b), signed for the shorter rotation).
RotorError Minus(const RotorState& a, const RotorState& b);
RotorNode Plus(const RotorNode& node, const RotorNodeError& error);

// Seeds derivative `seed` of `out`, whose value is `x`, with error column `column`.
template <class Jet>
void SeedError(const RotorState& x, int column, int seed, Jet* out) {
  if (column >= 3) {
    out[column + 1].v[seed] = 1.0;
    return;
  }
  const Vec4<double> q = x.head<4>();
  const Vec4<double> slope = TimesPure(q, Vec3<double>(0.5 * Vec3<double>::Unit(column)));
  for (int i = 0; i < 4; ++i) out[i].v[seed] = slope[i];
}
// `x` with derivatives by the error state.
void SeedErrors(const RotorState& x, RotorJet* out);

// The motors' unknowns among the constants.
inline MotorValues MotorsOf(const RotorConstants& constants) {
  return constants.segment<kMotorUnknowns>(RotorAeroModel::kMotors - RotorAeroModel::kMoving);
}

// The pose sensor's place, m, in E.
inline Eigen::Vector3d SensedPosition(const RotorState& x) {
  Eigen::Vector3d p_E;
  RotorAeroModel::Position(x.data(), p_E.data());
  return p_E;
}
inline Eigen::Matrix3d AttitudeOf(const RotorState& x) {  // R_E_B
  return Eigen::Quaterniond(x[0], x[1], x[2], x[3]).normalized().toRotationMatrix();
}
// The IMU's place from the centre of mass, m.
inline Eigen::Vector3d ImuArmOf(const RotorState& x) {
  return x.segment<3>(RotorDrivenModel::kImuArm) - x.segment<3>(RotorDrivenModel::kCentre);
}

// Constants and moving part as one state.
RotorState Joined(const MovingState& motion, const RotorConstants& constants);

// Noise that the rotor-driven estimators assume of sensors and of unmodelled forces.
//
// Sensor sigmas are of one sample. Disturbances are white: under a density n the velocity does a
// random walk of variance n^2 t. The accelerometer measures them too. They represent all unmodelled
// forces and moments.
//
// The drift is an unmodelled angular acceleration that lasts: a first-order Gauss-Markov process
// about each axis. An autopilot holds the attitude against it, so the rotors' slow moments cancel
// it. Without this state those moments seem to turn nothing, and the inertia comes out too large.
struct RotorNoise {
  double accel = 2.2;               // m/s^2; 4.84 (m/s^2)^2 in Wuest et al. 2019
  double gyro = 0.1732;             // rad/s; 0.03 (rad/s)^2
  double position = 0.01;           // m
  double attitude = 0.01;           // rad
  double force_density = 0.1;       // m/s^2/sqrt(Hz), specific force, each axis
  double angular_density = 0.5;     // rad/s^2/sqrt(Hz), angular acceleration, each axis
  double angular_drift = 0.0;       // rad/s^2, sigma; 0: none
  double angular_drift_time = 0.5;  // s, time constant

  // The drift's sigma in a fit: without drift a state that is all but held at zero.
  double DriftSigma() const { return std::max(angular_drift, 1e-6); }
  // The share of the drift that is left after dt seconds, and the variance of what came in, of
  // each axis.
  double DriftLeft(double dt) const { return std::exp(-dt / angular_drift_time); }
  double NewDrift(double dt) const {
    return -angular_drift * angular_drift * std::expm1(-2.0 * dt / angular_drift_time);
  }
  bool operator==(const RotorNoise&) const = default;
};

void Serialize(YamlArchive* a, RotorNoise* noise);

}  // namespace trueline
