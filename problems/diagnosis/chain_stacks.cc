#include "problems/diagnosis/chain_stacks.h"

#include <cmath>

#include "problems/vgd/make_segment.h"

namespace trueline {
namespace {

constexpr double kOpenPosition = 100.0, kOpenVelocity = 50.0;  // m, m/s: prior sigma of an unknown
                                                               // initial state

// Copies a row of the flight, times w, to row `at` of the stack.
void CopyRow(const LinearFlight& linear, int row, double w, int at, SegmentRows* stack) {
  const int columns = linear.columns.count();
  stack->node().row(at) = w * linear.rows.d_node.row(row);
  stack->next().row(at) = w * linear.rows.d_next.row(row);
  auto border = stack->border().row(at);
  border.head<kThetaSize>() = w * linear.rows.d_theta.row(row);
  if (columns > 0) border.segment(kThetaSize, columns) = w * linear.columns.d_rows.row(row);
  border[kThetaSize + columns] = w * linear.rows.r[row];
}

template <class Sigma>
SegmentRows MeasurementStack(const LinearFlight& linear, int segment, bool fixes,
                             Sigma&& sigma_of) {
  std::vector<int> chosen;
  for (const int row : linear.flight.RowsOfSegment(segment)) {
    if (linear.flight.IsFix(row) == fixes) chosen.push_back(row);
  }
  SegmentRows stack(static_cast<int>(chosen.size()), linear.width());
  for (int at = 0; at < static_cast<int>(chosen.size()); ++at) {
    const double sigma = sigma_of(chosen[at]);
    stack.id[at] = chosen[at];
    stack.cluster[at] = linear.flight.ClusterOfRow(chosen[at]);
    stack.log_weights -= std::log(sigma);
    CopyRow(linear, chosen[at], linear.weight[chosen[at]] / sigma, at, &stack);
  }
  return stack;
}

}  // namespace

Columns Columns::With(const Columns& more) const {
  const int total = count() + more.count();
  Columns all{Eigen::MatrixXd(d_rows.rows(), total), Eigen::VectorXd(total),
              Eigen::VectorXd(total)};
  all.d_rows << d_rows, more.d_rows;
  all.precision << precision, more.precision;
  all.value << value, more.value;
  return all;
}

SegmentRows FixStack(const LinearFlight& linear, int segment, double scale) {
  return MeasurementStack(linear, segment, true,
                          [&](int row) { return scale * linear.flight.FixSigma(row); });
}

SegmentRows ForceStack(const LinearFlight& linear, int segment, double sigma) {
  return MeasurementStack(linear, segment, false, [&](int) { return sigma; });
}

bool StartsStretch(const FlightPlan& plan, int segment) {
  return segment == 0 || !plan.segments[segment - 1].linked;
}

SegmentRows LinkStack(const LinearFlight& linear, int s, const NoiseStrengths& noise) {
  const auto& span = linear.flight.plan().segments[s];
  if (!span.linked) return SegmentRows(0, linear.width());
  SegmentRows stack(9 + kGustSize, linear.width());
  stack.cluster.assign(stack.cluster.size(), span.cluster);
  const double h = SecondsBetween(span.begin, span.end), alpha = noise.process.Decay(h);
  const Eigen::Vector3d unit = linear.flight.scaling().DriftUnit();
  const NodeVector &here = linear.x.nodes[s], &there = linear.x.nodes[s + 1];
  const int residual = static_cast<int>(stack.values.cols()) - 1;
  for (int i = 0; i < 6; ++i) CopyRow(linear, linear.flight.LinkRow(s) + i, 1.0, i, &stack);
  stack.node().block<3, 3>(6, 0) = (-alpha * unit).asDiagonal();
  stack.next().block<3, 3>(6, 0) = unit.asDiagonal();
  stack.values.col(residual).segment<3>(6) =
      unit.cwiseProduct(there.head<3>() - alpha * here.head<3>());
  const Matrix9d whiten = StepSqrtInformation(noise.process, h, linear.flight.gravity());
  stack.values.topRows<9>() = (whiten * stack.values.topRows<9>()).eval();
  stack.log_weights += whiten.diagonal().array().log().sum();  // log determinant of a triangular
                                                               // matrix

  const double beta = noise.process.GustDecay(h);
  const double w = 1.0 / noise.process.GustStepSigma(h);
  stack.node().block<2, 2>(9, kGustAt).diagonal().setConstant(-beta * w);
  stack.next().block<2, 2>(9, kGustAt).diagonal().setConstant(w);
  stack.values.col(residual).segment<2>(9) = w * (there.tail<2>() - beta * here.tail<2>());
  stack.log_weights += 2.0 * std::log(w);
  return stack;
}

SegmentRows StartStack(const LinearFlight& linear, int s, const NoiseStrengths& noise) {
  if (!StartsStretch(linear.flight.plan(), s)) return SegmentRows(0, linear.width());
  SegmentRows stack(kNodeSize, linear.width());
  stack.cluster.assign(kNodeSize, linear.flight.plan().segments[s].cluster);
  const Eigen::Vector3d drift = noise.process.DriftSigma().cwiseMax(1e-5);
  NodeVector w;
  w.head<3>() = linear.flight.scaling().DriftUnit().cwiseQuotient(drift);
  w.segment<3>(kStateAt).setConstant(1.0 / kOpenPosition);
  w.segment<3>(kStateAt + 3).setConstant(1.0 / kOpenVelocity);
  w.tail<2>().setConstant(1.0 / noise.process.gust);
  NodeVector at_prior = linear.x.nodes[s];
  at_prior.segment<kStateSize>(kStateAt).setZero();  // the initial state has no prior mean
  stack.node() = w.asDiagonal();
  stack.values.col(stack.values.cols() - 1) = w.cwiseProduct(at_prior);
  stack.log_weights += w.array().log().sum();
  return stack;
}

}  // namespace trueline
