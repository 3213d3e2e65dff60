#include "cost_functions/models/rotation.h"
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
      of_reading = -at.reading.slope.leftCols<kErrorRows>().lazyProduct(moved);
      of_reading -= DisturbanceFeedthrough(at.x).lazyProduct(pushed.topRows<6>());
      of_reading -= pushed.bottomRows<6>();
      row += 6;
    }
    push(step.t + 0.5 * step.dt, at.x, &pushed);
    moved = at.F.leftCols<kErrorRows>().lazyProduct(moved).eval();
    moved += DisturbanceInput(at.x, step.dt).lazyProduct(pushed.topRows<6>());
  }
  rows.bottomRows<kErrorRows>() = -moved;
  rows.middleRows<3>(row) = AttitudeErrorSlope(path.end, next) * moved.topRows<3>();
  return rows;
}

}  // namespace trueline
