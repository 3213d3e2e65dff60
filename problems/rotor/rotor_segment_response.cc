#include "cost_functions/models/rotation.h"
#include "problems/rotor/rotor_segment.h"
#include "problems/rotor/rotor_slopes.h"
#include "problems/rotor/rotor_step.h"

namespace trueline {

Eigen::MatrixXd SegmentModel::Respond(const RotorNode& start, const RotorNode& next,
                                      const RotorConstants& constants, int columns,
                                      const PushFunction& push) const {
  constexpr int kErrorRows = RotorAeroModel::kMovingErrors;
  const Eigen::Matrix<double, 6, 1> none = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(segment_.NumRows(), columns);
  Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(kErrorRows, columns);
  Eigen::MatrixXd pushed = Eigen::MatrixXd::Zero(12, columns);
  RotorState x = Joined(start, constants);
  int row = 0;
  for (const RotorSegment::Step& step : segment_.steps) {
    if (step.imu >= 0) {
      const RotorReading reading = ReadWithSlope(model_, x, data_.InputAt(step.t));
      push(step.t, x, &pushed);
      rows.middleRows<6>(row).noalias() = -reading.slope.leftCols<kErrorRows>() * moved;
      rows.middleRows<6>(row).noalias() -= DisturbanceFeedthrough(x) * pushed.topRows<6>();
      rows.middleRows<6>(row) -= pushed.bottomRows<6>();
      row += 6;
    }
    const double middle = step.t + 0.5 * step.dt;
    push(middle, x, &pushed);
    const Eigen::Matrix<double, kErrorRows, 6> G = DisturbanceInput(x, step.dt);
    const RotorStepMatrix F = StepWithSlope(model_, data_.InputAt(middle), none, step.dt, &x);
    moved = (F.leftCols<kErrorRows>() * moved + G * pushed.topRows<6>()).eval();
  }
  x.head<4>().normalize();
  rows.bottomRows<kErrorRows>() = -moved;
  rows.middleRows<3>(row) = AttitudeErrorSlope(x, next) * moved.topRows<3>();
  return rows;
}

}  // namespace trueline
