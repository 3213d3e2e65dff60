// Derivatives of the rotor-driven model by its error state, by hand: rigid-body algebra is short,
// and Jets of as many numbers as there are errors cost ten times as much. What effects add is
// differentiated automatically (RotorEffects' templates), so that a new one needs nothing here.
#pragma once

#include <Eigen/Dense>

#include "problems/rotor_data/rotor_state.h"

namespace trueline {

using RotorPushMatrix = Eigen::Matrix<double, 6, RotorAeroModel::kErrors>;
using RotorStepMatrix =
    Eigen::Matrix<double, RotorAeroModel::kMovingErrors, RotorAeroModel::kErrors>;

// Specific force [m/s^2] and angular acceleration [rad/s^2] in body axes, and their derivatives.
struct RotorPush {
  Eigen::Vector3d force, turn;
  RotorPushMatrix slope;
};
RotorPush PushWithSlope(const RotorAeroModel& model, const RotorState& x, const RotorInput& input);

// Accelerometer [m/s^2] then gyro [rad/s].
struct RotorReading {
  Eigen::Matrix<double, 6, 1> y;
  RotorPushMatrix slope;
};
RotorReading ReadWithSlope(const RotorAeroModel& model, const RotorState& x,
                           const RotorInput& input);

// RotorMidpointStep of `x`; returns d(moving error after it) / d(error before). Attitudes within
// the step are taken for unit quaternions, which they are to second order in the turn.
RotorStepMatrix StepWithSlope(const RotorAeroModel& model, const RotorInput& input,
                              const Eigen::Matrix<double, 6, 1>& disturbance, double dt,
                              RotorState* x);

}  // namespace trueline
