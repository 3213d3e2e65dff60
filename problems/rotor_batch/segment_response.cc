#include <array>

#include "cost_functions/models/rotation.h"
#include "problems/rotor_batch/segment.h"
#include "problems/rotor_data/rotor_step.h"

namespace trueline {

// A push acts as if the start had been moved by A^-1 G push, A the transition up to its end.
Eigen::MatrixXd SegmentModel::Respond(const RotorNode& start, const RotorNode& next,
                                      const RotorConstants& constants, int columns,
                                      const PushFunction& push) const {
  constexpr int kMoving = RotorAeroModel::kMovingErrors;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(segment_.NumRows(), columns);
  Eigen::MatrixXd at_start = Eigen::MatrixXd::Zero(kMoving, columns), pushed(6, columns);
  std::array<RotorJet, RotorAeroModel::kStates> x;
  std::array<RotorJet, 6> none, y;
  none.fill(RotorJet(0.0));
  SeedErrors(Joined(start, constants), x.data());
  int row = 0;
  for (const RotorSegment::Step& step : segment_.steps) {
    RotorState now;
    for (int i = 0; i < RotorAeroModel::kStates; ++i) now[i] = x[i].a;
    if (step.imu >= 0) {
      model_.Imu(x.data(), data_.InputAt(step.t), y.data());
      Eigen::Matrix<double, 6, kMoving> d_reading;
      for (int i = 0; i < 6; ++i) d_reading.row(i) = y[i].v.head<kMoving>().transpose();
      push(step.t, now, &pushed);
      rows.middleRows<6>(row) = -d_reading * at_start - DisturbanceFeedthrough(now) * pushed;
      row += 6;
    }
    const double middle = step.t + 0.5 * step.dt;
    push(middle, now, &pushed);
    RotorMidpointStep(model_, data_.InputAt(middle), none.data(), step.dt, x.data());
    const Eigen::Matrix<double, kMoving, kMoving> transition =
        MovingSensitivity(x.data()).leftCols<kMoving>();
    at_start += transition.partialPivLu().solve(DisturbanceInput(now, step.dt) * pushed);
  }
  RotorState end;
  for (int i = 0; i < RotorAeroModel::kStates; ++i) end[i] = x[i].a;
  end.head<4>().normalize();
  const Eigen::MatrixXd d_end = MovingSensitivity(x.data()).leftCols<kMoving>() * at_start;
  rows.bottomRows<kMoving>() = -d_end;
  rows.middleRows<3>(row) = AttitudeErrorSlope(end, next) * d_end.topRows<3>();
  return rows;
}

}  // namespace trueline
