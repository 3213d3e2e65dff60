// One time step of the rotor-driven model, shared by filter and batch, and the influence of
// disturbances on it.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "problems/rotor/rotor_data.h"
#include "problems/rotor/rotor_state.h"

namespace trueline {

// Longer gaps in the IMU are stepped through, s.
inline constexpr double kLongestStep = 0.01;

// One explicit midpoint step of `dt` seconds of a state of kStates numbers. `input` is taken at the
// middle of the step; `disturbance` (6 numbers, see RotorAeroModel) is constant over it.
template <class T>
void RotorMidpointStep(const RotorAeroModel& model, const RotorInput& input, const T* disturbance,
                       double dt, T* x) {
  using Model = RotorAeroModel;
  std::array<T, Model::kMoving> slope;
  model.Derivative(x, input, disturbance, slope.data());
  std::array<T, Model::kStates> middle;
  for (int i = 0; i < Model::kStates; ++i) {
    middle[i] = i < Model::kMoving ? T(x[i] + slope[i] * T(0.5 * dt)) : x[i];
  }
  model.Derivative(middle.data(), input, disturbance, slope.data());
  for (int i = 0; i < Model::kMoving; ++i) x[i] += slope[i] * T(dt);
}

// The state at `to` [s] of `x` at `from`, by the rotors and by the drift at `from`, which decays:
// midpoint steps of 4 ms or less. `drift` becomes what is left of it.
inline RotorState Integrated(const RotorAeroModel& model, const RotorData& data,
                             const RotorNoise& noise, RotorState x, Eigen::Vector3d* drift,
                             double from, double to) {
  constexpr double kStep = 0.004;  // s
  Eigen::Matrix<double, 6, 1> held = Eigen::Matrix<double, 6, 1>::Zero();
  const int steps = std::max(1, static_cast<int>(std::ceil((to - from) / kStep - 1e-9)));
  const double dt = (to - from) / steps;
  for (int k = 0; k < steps; ++k) {
    held.tail<3>() = *drift;
    RotorMidpointStep(model, data.InputAt(from + (k + 0.5) * dt), held.data(), dt, x.data());
    x.head<4>().normalize();
    *drift *= noise.DriftLeft(dt);
  }
  return x;
}

// Covariance of the disturbance that is held over a step of `dt` seconds from `t`, 6 x 6: white
// forces and moments, and those that the errors of the rotor speeds make. Within the bandwidth of
// the smoothed speeds these errors are white, too.
inline Eigen::Matrix<double, 6, 6> DisturbanceCovariance(const RotorAeroModel& model,
                                                         const RotorData& data,
                                                         const RotorNoise& noise,
                                                         const RotorState& x, double t, double dt) {
  Eigen::Matrix<double, 6, 6> cov = Eigen::Matrix<double, 6, 6>::Zero();
  if (const double density = data.speed_density; density > 0.0) {
    const auto by = model.BySpeeds(x.data(), data.InputAt(t));
    cov = by.lazyProduct(by.transpose()) * (density * density / dt);
  }
  cov.diagonal().head<3>().array() += noise.force_density * noise.force_density / dt;
  cov.diagonal().tail<3>().array() += noise.angular_density * noise.angular_density / dt;
  return cov;
}

// d(moving error after the step) / d(disturbance held over it): 12 x 6.
inline Eigen::Matrix<double, RotorAeroModel::kMovingErrors, 6> DisturbanceInput(const RotorState& x,
                                                                                double dt) {
  const Eigen::Matrix3d R = AttitudeOf(x);
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, RotorAeroModel::kMovingErrors, 6> G;
  G.setZero();
  G.block<3, 3>(0, 3) = 0.5 * dt * dt * I;
  G.block<3, 3>(3, 0) = 0.5 * dt * dt * R;
  G.block<3, 3>(6, 0) = dt * R;
  G.block<3, 3>(9, 3) = dt * I;
  return G;
}

// d(IMU reading) / d(disturbance at that time), 6 x 6: the accelerometer measures the force, and
// the angular acceleration through its lever arm.
inline Eigen::Matrix<double, 6, 6> DisturbanceFeedthrough(const RotorState& x) {
  const Eigen::Vector3d arm = ImuArmOf(x);
  Eigen::Matrix<double, 6, 6> D;
  D.setZero();
  D.block<3, 3>(0, 0).setIdentity();
  for (int i = 0; i < 3; ++i) {
    D.block<3, 1>(0, 3 + i) = Eigen::Vector3d::Unit(i).cross(arm);
  }
  return D;
}

}  // namespace trueline
