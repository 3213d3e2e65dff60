// The state of the rotor-driven estimators and its minimal error: attitude errors in body axes,
// q = q0 (1, theta / 2), then one number for each state (RotorAeroModel).
#pragma once

#include <ceres/jet.h>

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "cost_functions/models/rotor_aero_model.h"

namespace trueline {

using RotorState = Eigen::Matrix<double, RotorAeroModel::kStates, 1>;
using RotorError = Eigen::Matrix<double, RotorAeroModel::kErrors, 1>;
using RotorErrorMatrix = Eigen::Matrix<double, RotorAeroModel::kErrors, RotorAeroModel::kErrors>;
using RotorConstants = Eigen::Matrix<double, RotorAeroModel::kConstants, 1>;
using RotorNode = Eigen::Matrix<double, RotorAeroModel::kMoving, 1>;
inline constexpr int kNodeErrors = RotorAeroModel::kMovingErrors;
// The place of I_x, I_y, I_z among the constants.
inline constexpr int kInertiaConstants = RotorDrivenModel::kInertia - RotorDrivenModel::kMoving;
using RotorJet = ceres::Jet<double, RotorAeroModel::kErrors>;

// Name and unit of each constant, in the model's order: m, I_x, ..., motor_voltage.
struct RotorConstantInfo {
  std::string name;
  std::string unit;
};
const std::vector<RotorConstantInfo>& RotorConstantNames();
// -1 where there is none.
int FindRotorConstant(const std::string& name);

// `x` moved by a finite error; the quaternion stays of unit length.
RotorState Plus(const RotorState& x, const RotorError& error);
// The error that takes `a` to `b` (attitude: 2 vec(q_a^* q_b), signed for the shorter way).
RotorError Minus(const RotorState& a, const RotorState& b);

// `x` with derivatives by its error state.
void SeedErrors(const RotorState& x, RotorJet* out);
// d(error state of the moving part) / d(seeds) of Jets that lie at `x`: kMovingErrors x kErrors.
Eigen::Matrix<double, RotorAeroModel::kMovingErrors, RotorAeroModel::kErrors> MovingSensitivity(
    const RotorJet* x);

// The motors' unknowns among the constants.
inline MotorValues MotorsOf(const RotorConstants& constants) {
  return constants.segment<kMotorUnknowns>(RotorAeroModel::kMotors - RotorAeroModel::kMoving);
}

// Constants and moving part as one state.
RotorState Joined(const RotorNode& moving, const RotorConstants& constants);

}  // namespace trueline
