#include "problems/vgd/window_problem.h"

#include <glog/logging.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "cost_functions/prior_residuals.h"
#include "problems/vgd/segment.h"
#include "problems/vgd/solver_options.h"

namespace trueline {

WindowProblem::WindowProblem(const DriveTrack& track, const WindowData& data,
                             const VgdOptions& options, const std::optional<WindowPrior>& past)
    : options_(options), chain_(options) {
  BuildSegments(track, data);
  if (HasCorrelatedFixes(data)) correlated_.emplace(&chain_, data.noise, options_);
  AddOffsets(data);
  if (correlated_) {
    const std::size_t last = data.fixes.size() - 1;
    const bool at_end = last > 0 && data.fixes.back().t == data.end;
    correlated_->Add(data.fixes, at_end ? last - 1 : last, 0, chain_.size(), past.has_value());
  } else {
    AddFixes(data);
  }
  if (options_.drag_measurement.enabled) {
    for (const ForceSample& force : data.forces) {
      chain_.AddForce(SegmentOf(force.t), force, data.force_sigma);
    }
  }
  for (std::size_t s = 0; s + 1 < chain_.size(); ++s) chain_.AddStep(s, track.gravity());
  if (past) {
    AddPast(*past);
  } else {
    AddPriors();
  }
  if (options_.HasBounds()) chain_.SetBounds();
}

// Knots are at the passes' begins and evenly between, so that the past can be marginalised at a
// pass. Where the changes between fixes are measured, knots are at the fixes, too.
void WindowProblem::BuildSegments(const DriveTrack& track, const WindowData& data) {
  std::vector<TimeNs> cuts{data.begin};
  if (options_.process.Any()) {
    for (const Pass& pass : data.passes.subspan(1)) cuts.push_back(pass.begin);
  }
  cuts.push_back(data.end);
  const double interval =
      options_.process.Any() ? options_.knot_interval : std::numeric_limits<double>::infinity();
  chain_.AddTheta();
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const std::vector<TimeNs> knots =
        HasCorrelatedFixes(data)
            ? KnotsAtFixes(data.fixes, cuts[i], cuts[i + 1], data.noise, interval)
            : EvenKnots(cuts[i], cuts[i + 1], interval);
    for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
      chain_.AddSegment(
          MakeSegment(track, data, knots[k], knots[k + 1], chain_.scaling(), options_.max_block),
          chain_.size() > 0);
    }
  }
}

void WindowProblem::AddOffsets(const WindowData& data) {
  for (const PassOffset& offset : data.offsets) {
    const Pass& pass = data.passes[offset.pass];
    Eigen::VectorXd weight(kOffsetSize);
    weight << Eigen::Vector3d::Constant(1.0 / offset.sigma),
        Eigen::Vector3d::Constant(1.0 / offset.rate_sigma);
    chain_.AddLogWeights(weight.array().log().sum());
    offsets_.push_back(
        {pass.begin, pass.end, chain_.AddBorder(SegmentOf(pass.begin), weight, false)});
  }
}

void WindowProblem::AddFixes(const WindowData& data) {
  auto offset = offsets_.begin();
  for (const Fix& fix : data.fixes) {
    const std::size_t s = SegmentOf(fix.t);
    const StateNode* state = chain_.segment(s).StateAt(fix.t);
    const FixError error{fix.p_E, options_.whiten ? fix.sigma : 1.0};
    const GustSlope<6> gusts = chain_.StateGusts(s, fix.t);
    ceres::LossFunction* loss = MakeLoss(options_.loss, options_.loss_scale);
    while (offset != offsets_.end() && offset->end < fix.t) ++offset;
    if (offset != offsets_.end() && offset->begin <= fix.t) {
      const double elapsed = SecondsBetween(offset->begin, fix.t);
      chain_.AddReading(s, new OffsetFixResidual(state, {error, elapsed}, gusts), loss,
                        {offset->value});
    } else {
      chain_.AddReading(s, new FixResidual(state, error, gusts), loss);
    }
  }
}

Eigen::Matrix<double, 6, 1> WindowProblem::FinalState() const {
  Eigen::Matrix<double, 6, 1> state = segments().back()->end_node()->value;
  if (!correlated_) return state;
  const Segment& last = *segments().back();
  const double tau = correlated_->delay(), seconds = SecondsBetween(last.start(), last.end());
  const Eigen::Vector3d v = state.tail<3>(), v0 = chain_.state(chain_.size() - 1).tail<3>();
  state.head<3>() += -tau * v + 0.5 * tau * tau * (v - v0) / seconds;
  return state;
}

std::optional<WindowProblem::Delay> WindowProblem::FixLatency() const {
  if (!correlated_) return std::nullopt;
  return Delay{correlated_->delay(), correlated_->prior().sigma * std::sqrt(delay_variance_)};
}

void WindowProblem::AddPriors() {
  ThetaVector weight = ThetaVector::Ones();
  open_ = options_.ranges != RangeUse::kPrior;
  if (open_) weight.head<kMotionSize>().setZero();
  chain_.AddThetaPrior(0, weight);
  if (options_.process.Any()) {
    chain_.AddStart(0);
  } else {
    chain_.HoldDrift();
  }
}

void WindowProblem::HoldOpenDirections() {
  if (!open_) return;
  ThetaVector weight = ThetaVector::Zero();
  weight.head<kMotionSize>().setConstant(kOpenWeight);
  chain_.AddThetaPrior(0, weight);
  open_ = false;
}

void WindowProblem::AddPast(const WindowPrior& past) {
  past_drag_errors_ = past.drag_errors;
  chain_.AddLogWeights(past.sqrt_information.householderQr().logAbsDeterminant());
  const PastError error{past.mean, past.sqrt_information};
  using Calm = ceres::AutoDiffCostFunction<PastError, WindowPrior::kSize, kThetaSize, kGustAt>;
  using Gusty = ceres::AutoDiffCostFunction<PastError, WindowPrior::kSize + kGustSize, kThetaSize,
                                            kGustAt, kGustSize>;
  if (chain_.HasGusts()) {
    chain_.AddNodePrior(0, new Gusty(new PastError(error)));
  } else {
    chain_.AddNodePrior(0, new Calm(new PastError(error)));
  }
}

void WindowProblem::SetStart(const Theta& theta, const RoughPath& path) {
  const ParameterScaling& scaling = chain_.scaling();
  chain_.theta().setZero();
  chain_.theta().head<kMotionSize>() =
      (theta - scaling.mean.head<kMotionSize>()).cwiseQuotient(scaling.sigma.head<kMotionSize>());
  for (std::size_t s = 0; s < chain_.size(); ++s) {
    if (s == 0 || chain_.segment(s).start() <= path.end()) {
      const LineFit guess = path.At(chain_.segment(s).start());
      chain_.SetState(s, guess.p, guess.v);
    } else {
      chain_.SetState(s, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
      chain_.Integrate(s - 1);
      const auto& end = chain_.segment(s - 1).end_node()->value;
      chain_.SetState(s, end.head<3>(), end.tail<3>());
    }
  }
}

ceres::Solver::Summary WindowProblem::Solve() {
  if (chain_.size() == 1 || options_.solver != VgdSolver::kTrustRegion) {
    return chain_.Solve(SolverOptions(options_, ceres::DENSE_NORMAL_CHOLESKY));
  }
  return chain_.Solve(TrustRegion(options_));
}

Eigen::Matrix<double, WindowProblem::kParameters, 1> WindowProblem::Parameters() const {
  return scaling().mean + scaling().sigma.cwiseProduct(chain_.theta());
}

Eigen::Vector3d WindowProblem::PositionAt(TimeNs t) const {
  return chain_.segment(SegmentOf(t)).StateAt(t)->value.head<3>();
}

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
