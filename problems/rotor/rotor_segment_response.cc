#include "cost_functions/models/rotation.h"
#include "problems/chain/small_product.h"
#include "problems/rotor/rotor_segment.h"
#include "problems/rotor/rotor_step.h"

namespace trueline {

Eigen::MatrixXd SegmentModel::Respond(const SegmentPath& path, const RotorNode& next, int columns,
                                      const AccelerationsByColumn& accelerations) const {
  constexpr int kErrorRows = RotorAeroModel::kMovingErrors;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(segment_.NumRows(), columns);
  Eigen::Matrix<double, kErrorRows, Eigen::Dynamic> moved =
      Eigen::MatrixXd::Zero(kErrorRows, columns);
  Eigen::MatrixXd added = Eigen::MatrixXd::Zero(12, columns);
  int row = 0;
  for (std::size_t k = 0; k < path.steps.size(); ++k) {
    const SegmentPath::Step& at = path.steps[k];
    const RotorSegment::Step& step = segment_.steps[k];
    if (step.imu >= 0) {
      accelerations(step.t, at.x, &added);
      auto of_reading = rows.middleRows<6>(row);
      of_reading = -added.bottomRows<6>();
      AddProduct(-1.0, at.reading.slope.leftCols<kErrorRows>(), moved, of_reading);
      AddProduct(-1.0, DisturbanceFeedthrough(at.x), added.topRows<6>(), of_reading);
      row += 6;
    }
    MultiplyLeft(at.F.by_error.leftCols<kErrorRows>(), moved);
    const double middle = step.t + 0.5 * step.dt;
    accelerations(middle, at.x, &added);
    AddProduct(1.0, at.F.by_first, added.topRows<6>(), moved);
    accelerations(middle, at.F.middle, &added);
    AddProduct(1.0, at.F.by_second, added.topRows<6>(), moved);
  }
  rows.middleRows<kErrorRows>(row) = -moved;
  rows.middleRows<3>(row) = AttitudeErrorSlope(path.end, next) * moved.topRows<3>();
  CarryTurn(path.arm, rows);
  return rows;
}

}  // namespace trueline
