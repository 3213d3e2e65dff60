// Derivatives of the rotor-driven model by its error state: automatic differentiation of the one
// model, four columns at a time. Jets of four stay in registers, and columns that nothing depends
// on are left out; the filter then takes 1.1 times, the batch 1.2 times what they take with
// derivatives written out by hand, where one Jet of all errors costs several times as much. A state
// that the model comes to depend on joins the list of columns in rotor_slopes.cc.
#pragma once

#include <Eigen/Dense>

#include "problems/rotor_data/rotor_state.h"

namespace trueline {

using RotorStepMatrix =
    Eigen::Matrix<double, RotorAeroModel::kMovingErrors, RotorAeroModel::kErrors>;

// Accelerometer [m/s^2] then gyro [rad/s].
struct RotorReading {
  Eigen::Matrix<double, 6, 1> y;
  Eigen::Matrix<double, 6, RotorAeroModel::kErrors> slope;
};
RotorReading ReadWithSlope(const RotorAeroModel& model, const RotorState& x,
                           const RotorInput& input);

// RotorMidpointStep of `x`; returns d(moving error after it) / d(error before).
RotorStepMatrix StepWithSlope(const RotorAeroModel& model, const RotorInput& input,
                              const Eigen::Matrix<double, 6, 1>& disturbance, double dt,
                              RotorState* x);

}  // namespace trueline
