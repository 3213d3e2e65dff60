#include "problems/diagnosis/noisy_flight.h"

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "problems/diagnosis/chain_system.h"
#include "problems/vgd/segment.h"

namespace trueline {
namespace {

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

NoisyFlight::NoisyFlight(const LinearFlight& linear)
    : linear_(linear), chain_(linear.width() - 1, 0), whitened_(kNodeSize, chain_.width()) {
  const auto measured = [](const SegmentRows& stack) {
    Rows rows;
    PutInChainOrder(stack.values, &rows);
    return Measurements{Compressed(rows), stack.count(), stack.log_weights};
  };
  for (int s = 0; s < static_cast<int>(linear.flight.plan().segments.size()); ++s) {
    segments_.push_back({measured(FixStack(linear, s, 1.0)), measured(ForceStack(linear, s, 1.0)),
                         PathRows(linear, s)});
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
