// Covariance of a window's solution by the Gauss-Newton Hessian at the optimum, and the
// marginalisation of its past.
#include <glog/logging.h>

#include <Eigen/Dense>
#include <algorithm>

#include "problems/vgd/window_problem.h"

namespace trueline {
namespace {

using Normal = SegmentChain::Normal;

// The R factor, square, of a matrix's QR decomposition. (QR keeps digits that the normal equations'
// Schur complement loses.)
Eigen::MatrixXd Triangle(const Eigen::MatrixXd& rows) {
  const Eigen::Index cols = rows.cols();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(std::max(rows.rows(), cols), cols);
  system.topRows(rows.rows()) = rows;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(system);
  return qr.matrixQR().topRows(cols).triangularView<Eigen::Upper>();
}

Eigen::MatrixXd Stacked(const Eigen::MatrixXd& above, const Eigen::MatrixXd& below) {
  Eigen::MatrixXd both(above.rows() + below.rows(), below.cols());
  both << above, below;
  return both;
}

void AppendRange(int first, int count, std::vector<int>* indices) {
  for (int i = 0; i < count; ++i) indices->push_back(first + i);
}

}  // namespace

WindowPrior WindowProblem::Marginalise(TimeNs t) {
  std::size_t kept = 0;  // first segment that is kept
  while (kept < chain_.size() && chain_.segment(kept).start() < t) ++kept;
  CHECK(kept > 0 && kept < chain_.size() && chain_.segment(kept).start() == t);

  // The rows that remain of the segments before, over a node, the offsets of passes before t, theta
  // and the residual. One node after the other is eliminated. (Later offsets are in none of these
  // rows, and QR without pivoting loses rows at columns of zeros.)
  const int node = chain_.HasGusts() ? kNodeSize : kGustAt;
  const int delay = correlated_ ? 1 : 0;
  const int border =
      delay + kOffsetSize * static_cast<int>(std::count_if(
                                offsets_.begin(), offsets_.end(),
                                [t](const Offset& offset) { return offset.begin < t; }));
  const int rest = border + kThetaSize + 1;
  std::vector<int> columns;
  AppendRange(Normal::kNodeAt, node, &columns);
  AppendRange(Normal::kNextAt, node, &columns);
  AppendRange(Normal::kBorderAt, border, &columns);
  AppendRange(Normal::kSharedAt, kThetaSize, &columns);
  columns.push_back(Normal::kBorderAt + delay + kOffsetSize * static_cast<int>(offsets_.size()));
  Eigen::MatrixXd carried(0, node + rest);
  for (std::size_t s = 0; s < kept; ++s) {
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(carried.rows(), 2 * node + rest);
    system.leftCols(node) = carried.leftCols(node);
    system.rightCols(rest) = carried.rightCols(rest);
    const Eigen::MatrixXd rows = chain_.Rows(s)(Eigen::all, columns);
    carried = Triangle(Stacked(system, rows)).bottomRightCorner(node + rest, node + rest);
  }
  // Last the border, then theta and the node that is kept.
  const int size = kThetaSize + node;
  std::vector<int> order;
  AppendRange(node, border + kThetaSize, &order);
  AppendRange(0, node, &order);
  order.push_back(node + rest - 1);
  const Eigen::MatrixXd R = Triangle(carried(Eigen::all, order));
  WindowPrior prior;
  prior.sqrt_information = R.block(border, border, size, size);
  Eigen::VectorXd at(size);
  at << chain_.theta(), chain_.node(kept).head(node);
  prior.mean = at - prior.sqrt_information.completeOrthogonalDecomposition().solve(
                        R.block(border, border + size, size, 1));
  prior.drag_errors = past_drag_errors_;
  prior.drag_errors.Add(own_drag_errors_,
                        static_cast<double>(kept) / static_cast<double>(chain_.size()));
  return prior;
}

// Theta and the final state depend on the last segment's unknowns alone.
WindowProblem::Uncertainty WindowProblem::FindUncertainty() {
  HoldOpenDirections();
  constexpr std::size_t kMost = 12;  // segments at which the velocity's covariance is computed
  const std::size_t last = chain_.size() - 1, stride = 1 + last / kMost;
  const StateNode& end = *chain_.segment(last).end_node();
  Uncertainty result;
  own_drag_errors_ = DragErrors();
  chain_.VisitCovariances([&](std::size_t s, const Eigen::MatrixXd& F) {
    if (s == last) {
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(kParameters + 6, F.cols());
      J.block<kThetaSize, kThetaSize>(0, kNodeSize).setIdentity();
      auto final_state = J.bottomRows<6>();
      final_state.leftCols<kDriftSize>() = end.d_drift();
      final_state.middleCols<kStateSize>(kStateAt) = end.d_state;
      if (chain_.HasGusts()) {
        final_state.middleCols<kGustSize>(kGustAt) =
            chain_.StateGusts(last, chain_.segment(last).end()).Own();
      }
      final_state.middleCols<kThetaSize>(kNodeSize) = end.d_theta;
      if (correlated_) {
        // Of the position that a delayed fix shows.
        const int at = kNodeSize + kThetaSize;
        final_state.topRows<3>() -=
            correlated_->delay() * Eigen::MatrixXd(final_state.bottomRows<3>());
        final_state.block<3, 1>(0, at) = -correlated_->prior().sigma * end.value.tail<3>();
        delay_variance_ = F(at, at);
      }
      result.cov = J * F * J.transpose();
    }
    if (HasForces() && s % stride == 0 && chain_.segment(s).force_count() > 0) {
      chain_.AddDragErrors(s, F, static_cast<int>(stride), &own_drag_errors_);
    }
  });
  result.drag_errors = past_drag_errors_;
  result.drag_errors.Add(own_drag_errors_);
  return result;
}

}  // namespace trueline
