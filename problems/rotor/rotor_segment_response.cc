#include "cost_functions/models/rotation.h"
#include "problems/chain/small_product.h"
#include "problems/rotor/rotor_segment.h"
#include "problems/rotor/rotor_step.h"

namespace trueline {

Eigen::MatrixXd SegmentModel::Respond(const SegmentPath& path, const RotorNode& next, int columns,
                                      const PushFunction& push) const {
  constexpr int kErrorRows = RotorAeroModel::kMovingErrors;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(segment_.NumRows(), columns);
  Eigen::Matrix<double, kErrorRows, Eigen::Dynamic> moved =
      Eigen::MatrixXd::Zero(kErrorRows, columns);
  Eigen::MatrixXd pushed = Eigen::MatrixXd::Zero(12, columns);
  int row = 0;
  for (std::size_t k = 0; k < path.steps.size(); ++k) {
    const SegmentPath::Step& at = path.steps[k];
    const RotorSegment::Step& step = segment_.steps[k];
    if (step.imu >= 0) {
      push(step.t, at.x, &pushed);
      auto of_reading = rows.middleRows<6>(row);
      of_reading = -pushed.bottomRows<6>();
      AddProduct(-1.0, at.reading.slope.leftCols<kErrorRows>(), moved, of_reading);
      AddProduct(-1.0, DisturbanceFeedthrough(at.x), pushed.topRows<6>(), of_reading);
      row += 6;
    }
    push(step.t + 0.5 * step.dt, at.x, &pushed);
    MultiplyLeft(at.F.by_error.leftCols<kErrorRows>(), moved);
    AddProduct(1.0, DisturbanceInput(at.x, step.dt), pushed.topRows<6>(), moved);
  }
  rows.middleRows<kErrorRows>(row) = -moved;
  rows.middleRows<3>(row) = AttitudeErrorSlope(path.end, next) * moved.topRows<3>();
  CarryTurn(path.arm, rows);
  return rows;
}

}  // namespace trueline
