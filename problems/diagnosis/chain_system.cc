#include "problems/diagnosis/chain_system.h"

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "problems/vgd/segment.h"

namespace trueline {
namespace {

constexpr double kOpen = 100.0;  // m and m/s, prior sigma of an unknown initial state

// Copies a row of the flight, times w, to row `at` of the stack.
void CopyRow(const LinearFlight& linear, int row, double w, int at, SegmentRows* stack) {
  const int columns = linear.columns.count();
  stack->node().row(at) << w * linear.rows.d_node.row(row), w * linear.rows.d_gust.row(row);
  stack->next().row(at) << w * linear.rows.d_next.row(row), w * linear.rows.d_next_gust.row(row);
  auto border = stack->border().row(at);
  border.head<kThetaSize>() = w * linear.rows.d_theta.row(row);
  if (columns > 0) border.segment(kThetaSize, columns) = w * linear.columns.d_rows.row(row);
  border[kThetaSize + columns] = w * linear.rows.r[row];
}

// Fixes of a segment, their sigmas times `scale`; or its forces, of the sigma `scale`.
SegmentRows MeasurementStack(const LinearFlight& linear, int segment, bool fixes, double scale) {
  std::vector<int> chosen;
  for (const int row : linear.flight.RowsOfSegment(segment)) {
    if (linear.flight.IsFix(row) == fixes) chosen.push_back(row);
  }
  SegmentRows stack(static_cast<int>(chosen.size()), linear.width());
  for (int at = 0; at < static_cast<int>(chosen.size()); ++at) {
    const double sigma = scale * (fixes ? linear.flight.FixSigma(chosen[at]) : 1.0);
    stack.id[at] = chosen[at];
    stack.cluster[at] = linear.flight.ClusterOfRow(chosen[at]);
    stack.log_weights -= std::log(sigma);
    CopyRow(linear, chosen[at], linear.weight[chosen[at]] / sigma, at, &stack);
  }
  return stack;
}

bool StartsStretch(const FlightPlan& plan, int segment) {
  return segment == 0 || !plan.segments[segment - 1].linked;
}

// The step's error, not whitened: (p, v, drift, gust) of the next node less the prediction.
NodeVector LinkError(const BaseFlight& flight, const FlightRows& rows, const FlightUnknowns& x,
                     int s, const ContinuityResidual::Weights& w) {
  const NodeVector &here = x.nodes[s], &there = x.nodes[s + 1];
  NodeVector error;
  error << rows.r.segment<6>(flight.LinkRow(s)),
      w.drift_unit.cwiseProduct(there.head<3>() - w.alpha * here.head<3>()),
      there.tail<2>() - w.beta * here.tail<2>();
  return error;
}

// One over the sigmas of the prior on a stretch's first unknowns.
NodeVector StartWeights(const BaseFlight& flight, const NoiseStrengths& noise) {
  NodeVector w;
  w << flight.scaling().DriftUnit().cwiseQuotient(noise.process.StartSigma()),
      Eigen::Matrix<double, kStateSize, 1>::Constant(1.0 / kOpen),
      Eigen::Vector2d::Constant(1.0 / noise.process.gust);
  return w;
}

NodeVector StartError(const NodeVector& node, const NodeVector& weights) {
  NodeVector error = weights.cwiseProduct(node);
  error.segment<kStateSize>(kStateAt).setZero();  // the initial state has no prior mean
  return error;
}

// Of the step from a segment to the next.
ContinuityResidual::Weights LinkWeights(const BaseFlight& flight, int s,
                                        const NoiseStrengths& noise) {
  return StepWeights(noise.process, flight.scaling().DriftUnit(), flight.segment(s),
                     flight.gravity());
}

// A step's rows before whitening as far as no noise changes them; none where no segment follows.
SegmentRows PathRows(const LinearFlight& linear, int s) {
  if (!linear.flight.plan().segments[s].linked) return SegmentRows(0, linear.width());
  SegmentRows link(kNodeSize, linear.width());
  for (int i = 0; i < 6; ++i) CopyRow(linear, linear.flight.LinkRow(s) + i, 1.0, i, &link);
  return link;
}

// What the processes' memory changes in them.
void EnterProcesses(const LinearFlight& linear, int s, const ContinuityResidual::Weights& w,
                    SegmentRows* link) {
  link->node().block<3, 3>(6, 0) = (-w.alpha * w.drift_unit).asDiagonal();
  link->next().block<3, 3>(6, 0) = w.drift_unit.asDiagonal();
  link->node().block<2, 2>(9, kGustAt).diagonal().setConstant(-w.beta);
  link->next().block<2, 2>(9, kGustAt).diagonal().setOnes();
  link->values.rightCols<1>() = LinkError(linear.flight, linear.rows, linear.x, s, w);
}

// The process rows: (p, v, drift) with the covariance that the processes accumulate, and the gust.
SegmentRows LinkStack(const LinearFlight& linear, int s, const NoiseStrengths& noise) {
  SegmentRows stack = PathRows(linear, s);
  if (stack.count() == 0) return stack;
  stack.cluster.assign(stack.cluster.size(), linear.flight.plan().segments[s].cluster);
  const ContinuityResidual::Weights w = LinkWeights(linear.flight, s, noise);
  EnterProcesses(linear, s, w, &stack);
  stack.values.topRows<kGustAt>() = (w.sqrt_information * stack.values.topRows<kGustAt>()).eval();
  stack.values.bottomRows<2>() *= w.gust_weight;
  stack.log_weights = LogDeterminant(w, true);
  return stack;
}

// The prior on a stretch's first unknowns.
SegmentRows StartStack(const LinearFlight& linear, int s, const NoiseStrengths& noise) {
  if (!StartsStretch(linear.flight.plan(), s)) return SegmentRows(0, linear.width());
  SegmentRows stack(kNodeSize, linear.width());
  stack.cluster.assign(kNodeSize, linear.flight.plan().segments[s].cluster);
  const NodeVector w = StartWeights(linear.flight, noise);
  stack.node() = w.asDiagonal();
  stack.values.rightCols<1>() = StartError(linear.x.nodes[s], w);
  stack.log_weights = w.array().log().sum();
  return stack;
}

BorderedChain<kNodeSize> MakeChain(const LinearFlight& linear, const NoiseStrengths& noise) {
  std::vector<SegmentRows> rows;
  for (int s = 0; s < static_cast<int>(linear.flight.plan().segments.size()); ++s) {
    rows.push_back(RowsOf(linear, s, noise));
  }
  return BorderedChain<kNodeSize>(std::move(rows));
}

// Orders a segment's rows as the chain's columns are: the next node first.
void PutInChainOrder(const SegmentRows::Values& rows, SegmentRows::Values* ordered) {
  *ordered = rows;
  ordered->leftCols<kNodeSize>() = rows.middleCols<kNodeSize>(kNodeSize);
  ordered->middleCols<kNodeSize>(kNodeSize) = rows.leftCols<kNodeSize>();
}

// Rows of the same squares, no more than columns.
SegmentRows::Values Compressed(const SegmentRows::Values& rows) {
  if (rows.rows() <= rows.cols()) return rows;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(rows);
  return qr.matrixQR().topRows(rows.cols()).triangularView<Eigen::Upper>();
}

}  // namespace

Columns Columns::Only(const std::vector<int>& kept) const {
  return {d_rows(Eigen::all, kept), precision(kept), value(kept)};
}

Columns Columns::With(const Columns& more) const {
  const int total = count() + more.count();
  Columns all{Eigen::MatrixXd(d_rows.rows(), total), Eigen::VectorXd(total),
              Eigen::VectorXd(total)};
  all.d_rows << d_rows, more.d_rows;
  all.precision << precision, more.precision;
  all.value << value, more.value;
  return all;
}

SegmentRows RowsOf(const LinearFlight& linear, int s, const NoiseStrengths& noise) {
  SegmentRows rows = MeasurementStack(linear, s, true, noise.fix_scale);
  rows.Add(MeasurementStack(linear, s, false, noise.force_sigma));
  rows.Add(LinkStack(linear, s, noise));
  rows.Add(StartStack(linear, s, noise));
  return rows;
}

double ProcessCost(const BaseFlight& flight, const FlightRows& rows, const FlightUnknowns& x,
                   const NoiseStrengths& noise) {
  double sum = 0.0;
  const NodeVector start = StartWeights(flight, noise);
  for (int s = 0; s < static_cast<int>(x.nodes.size()); ++s) {
    if (StartsStretch(flight.plan(), s)) sum += StartError(x.nodes[s], start).squaredNorm();
    if (!flight.plan().segments[s].linked) continue;
    const ContinuityResidual::Weights w = LinkWeights(flight, s, noise);
    const NodeVector error = LinkError(flight, rows, x, s, w);
    sum += (w.sqrt_information * error.head<kGustAt>()).squaredNorm() +
           (w.gust_weight * error.tail<2>()).squaredNorm();
  }
  return 0.5 * sum;
}

ReducedSystem::Prior BorderPrior(const LinearFlight& linear) {
  const int columns = linear.columns.count();
  ReducedSystem::Prior prior{Eigen::VectorXd::Ones(kThetaSize + columns),
                             Eigen::VectorXd(kThetaSize + columns)};
  prior.precision.tail(columns) = linear.columns.precision;
  prior.error << linear.x.theta, linear.columns.value;
  return prior;
}

ChainSystem::ChainSystem(const LinearFlight& linear, const NoiseStrengths& noise)
    : flight_(linear.flight),
      prior_(BorderPrior(linear)),
      chain_(MakeChain(linear, noise)),
      reduced_(chain_.Reduced(prior_)) {}

ReducedSystem ChainSystem::ByCluster() const {
  return chain_.Reduced(prior_, flight_.plan().clusters);
}

Eigen::VectorXd ChainSystem::Whitened(const Eigen::VectorXd& e) const {
  Eigen::VectorXd whitened = Eigen::VectorXd::Zero(flight_.measurement_rows());
  chain_.VisitRowsAt(e, [&](std::size_t, const SegmentRows& rows, const Eigen::MatrixXd& at) {
    for (int i = 0; i < rows.count(); ++i) {
      if (rows.id[i] >= 0) whitened[rows.id[i]] = at(i, 0);
    }
  });
  return whitened;
}

NoisyFlight::NoisyFlight(const LinearFlight& linear)
    : linear_(linear), chain_(linear.width() - 1, 0), whitened_(kNodeSize, chain_.width()) {
  const auto measured = [](const SegmentRows& stack) {
    Rows rows;
    PutInChainOrder(stack.values, &rows);
    return Measurements{Compressed(rows), stack.count(), stack.log_weights};
  };
  for (int s = 0; s < static_cast<int>(linear.flight.plan().segments.size()); ++s) {
    segments_.push_back({measured(MeasurementStack(linear, s, true, 1.0)),
                         measured(MeasurementStack(linear, s, false, 1.0)), PathRows(linear, s)});
  }
}

ReducedSystem NoisyFlight::Reduced(const NoiseStrengths& noise) {
  chain_.Begin(std::numeric_limits<double>::infinity());
  double log_weights = 0.0;
  const auto add = [&](const Measurements& measured, double sigma) {
    chain_.AddRows(measured.rows.data(), static_cast<int>(measured.rows.rows()),
                   1.0 / (sigma * sigma));
    log_weights += measured.log_weights - measured.count * std::log(sigma);
  };
  for (int s = 0; s < static_cast<int>(segments_.size()); ++s) {
    add(segments_[s].fixes, noise.fix_scale);
    add(segments_[s].forces, noise.force_sigma);
    log_weights += AddLink(s, noise);
    if (StartsStretch(linear_.flight.plan(), s)) {
      const SegmentRows start = StartStack(linear_, s, noise);
      PutInChainOrder(start.values, &ordered_);
      chain_.AddRows(ordered_.data(), start.count());
      log_weights += start.log_weights;
    }
    chain_.EndNode();
  }
  return {{chain_.BorderGram()}, BorderPrior(linear_), chain_.log_det(), log_weights};
}

double NoisyFlight::AddLink(int segment, const NoiseStrengths& noise) {
  SegmentRows& link = segments_[segment].link;
  if (link.count() == 0) return 0.0;
  const ContinuityResidual::Weights w = LinkWeights(linear_.flight, segment, noise);
  EnterProcesses(linear_, segment, w, &link);
  whitened_.topRows<kGustAt>() = w.sqrt_information.lazyProduct(link.values.topRows<kGustAt>());
  whitened_.bottomRows<kGustSize>() = w.gust_weight * link.values.bottomRows<kGustSize>();
  PutInChainOrder(whitened_, &ordered_);
  chain_.AddRows(ordered_.data(), kNodeSize);
  return LogDeterminant(w, true);
}

}  // namespace trueline
