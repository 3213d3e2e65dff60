// Derivatives of the rotor-driven model by its error state. Force and moment
// (RotorAeroModel::BodyAccelerationOf) are differentiated automatically, four columns at a time:
// Jets of four stay in registers, and columns without influence are skipped. One Jet of all errors
// takes several times as long. Without terms of the open catalogue, force and moment depend on the
// attitude through the velocity in body axes only, and not on the place over the ground. How they
// move the state and its readings (RotorDrivenModel) is differentiated by hand.
// If the model comes to depend on another state, add its column in rotor_slopes.cc.
#pragma once

#include <Eigen/Core>
#include <Eigen/Dense>
#include <array>
#include <span>
#include <vector>

#include "problems/rotor/rotor_state.h"

namespace trueline {

using RotorStepMatrix =
    Eigen::Matrix<double, RotorAeroModel::kMovingErrors, RotorAeroModel::kErrors>;

// The constants that slopes are by, beside the moving state. Columns of other constants are to be
// ignored.
class SlopeColumns {
 public:
  explicit SlopeColumns(const std::vector<int>& constants);
  static const SlopeColumns& All();

  // The states (RotorAeroModel::Index) that force and moment are differentiated by. The motors'
  // unknowns matter where speeds come from commands.
  std::span<const int> States(const RotorInput& input) const;
  // The constants among them.
  std::span<const int> Constants(const RotorInput& input) const;

 private:
  // The motors' unknowns, other constants, moving states.
  std::array<int, RotorAeroModel::kStates> states_{};
  std::size_t motors_ = 0, constants_ = 0, all_ = 0;  // where each kind ends
};

// Indices of all constants.
std::vector<int> AllRotorConstants();

// Accelerometer [m/s^2] then gyro [rad/s].
struct RotorReading {
  Eigen::Matrix<double, 6, 1> y;
  Eigen::Matrix<double, 6, RotorAeroModel::kErrors> slope;
};
// `drift`: an angular acceleration beside the model's, rad/s^2.
RotorReading ReadWithSlope(const RotorAeroModel& model, const RotorState& x,
                           const RotorInput& input, const Eigen::Vector3d& drift,
                           const SlopeColumns& columns = SlopeColumns::All());

// d(moving error after a step) / d(error before it), and by what is added to the specific force and
// the angular acceleration in body axes (6 numbers, as RotorMidpointStep's `disturbance`) at the
// two states that the step evaluates them at. A rate that a known moment changes differs between
// the two, and with it what goes with the rate.
struct RotorStepSlope {
  using ByAdded = Eigen::Matrix<double, RotorAeroModel::kMovingErrors, 6>;
  RotorStepMatrix by_error;
  ByAdded by_first, by_second;
  RotorState middle;  // the second of the states; the first is the start
  // By an angular acceleration that is held over the step.
  auto by_turn() const { return by_first.rightCols<3>() + by_second.rightCols<3>(); }
};
// RotorMidpointStep of `x`.
RotorStepSlope StepWithSlope(const RotorAeroModel& model, const RotorInput& input,
                             const Eigen::Matrix<double, 6, 1>& disturbance, double dt,
                             RotorState* x, const SlopeColumns& columns = SlopeColumns::All());

// Products with small matrices of a fixed number of rows, column by column. Eigen's general product
// first packs its factors, which takes longer than these products.

// *sum += factor a b. `sum` must not be part of b.
template <class A, class B, class Sum>
void AddProduct(double factor, const A& a, const B& b, Sum&& sum) {
  constexpr int kRows = A::RowsAtCompileTime;
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    Eigen::Matrix<double, kRows, 1> column = sum.col(j);
    for (Eigen::Index k = 0; k < a.cols(); ++k) column += (factor * b.coeff(k, j)) * a.col(k);
    sum.col(j) = column;
  }
}

// b = a b for square a.
template <class A, class B>
void MultiplyLeft(const A& a, B&& b) {
  constexpr int kSize = A::RowsAtCompileTime;
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    Eigen::Matrix<double, kSize, 1> column = Eigen::Matrix<double, kSize, 1>::Zero();
    for (int k = 0; k < kSize; ++k) column += b.coeff(k, j) * a.col(k);
    b.col(j) = column;
  }
}

}  // namespace trueline
