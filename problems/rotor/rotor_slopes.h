// Derivatives of the rotor-driven model by its error state, by automatic differentiation in four
// columns at a time. Jets of four stay in registers, and columns without influence are skipped. The
// filter takes 1.1 times and the batch 1.2 times as long as with hand-written derivatives; one Jet
// of all errors takes several times as long. If the model comes to depend on another state, add its
// column in rotor_slopes.cc.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <span>
#include <vector>

#include "problems/rotor/rotor_state.h"

namespace trueline {

using RotorStepMatrix =
    Eigen::Matrix<double, RotorAeroModel::kMovingErrors, RotorAeroModel::kErrors>;

// The columns of the error state that slopes are computed for: those of the moving state and of
// some constants. Columns of other constants are zero or left out.
class SlopeColumns {
 public:
  explicit SlopeColumns(const std::vector<int>& constants);
  static const SlopeColumns& All();     // of all constants
  static const SlopeColumns& Moving();  // of none

  // Those that a step or a reading depends on with this input. The motors' unknowns matter where
  // speeds come from commands.
  std::span<const int> OfStep(const RotorInput& input) const;
  std::span<const int> OfReading(const RotorInput& input) const;

 private:
  // Of the motors' unknowns, then those that motion depends on, then those that readings alone
  // depend on.
  std::array<int, RotorAeroModel::kErrors> columns_{};
  std::size_t motors_ = 0, step_ = 0, reading_ = 0;  // where each kind ends
};

// Indices of all constants.
std::vector<int> AllRotorConstants();

// Accelerometer [m/s^2] then gyro [rad/s].
struct RotorReading {
  Eigen::Matrix<double, 6, 1> y;
  Eigen::Matrix<double, 6, RotorAeroModel::kErrors> slope;
};
RotorReading ReadWithSlope(const RotorAeroModel& model, const RotorState& x,
                           const RotorInput& input,
                           const SlopeColumns& columns = SlopeColumns::All());

// RotorMidpointStep of `x`; returns d(moving error after it) / d(error before).
RotorStepMatrix StepWithSlope(const RotorAeroModel& model, const RotorInput& input,
                              const Eigen::Matrix<double, 6, 1>& disturbance, double dt,
                              RotorState* x, const SlopeColumns& columns = SlopeColumns::All());

}  // namespace trueline
