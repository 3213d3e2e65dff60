#include "problems/observability/e2log.h"

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/common/parallel.h"
#include "problems/observability/local_gramian.h"

namespace trueline {
namespace {

constexpr int kErrors = RotorDrivenSystem::kErrors;
constexpr int kMoving = RotorDrivenSystem::kMovingErrors;
using Square = Eigen::Matrix<double, kErrors, kErrors>;
using MovingRows = Eigen::Matrix<double, kMoving, kErrors>;

struct SegmentGramian {
  Square gramian;
  MovingRows transition;  // constants: rows of the identity
};

template <int kOrder>
SegmentGramian OneSegment(const RotorDrivenSystem& system, const RotorFlight& flight,
                          const std::vector<double>& weights, const SegmentTimes& segment) {
  const auto flat = FlatSeries<Taylor<double, kOrder + 4>>(
      flight.path().ExpandPiece(segment.piece, segment.start, kOrder + 4));
  const auto start = StartFromFlat<double, kOrder>(flight.vehicle(), flight.parameters(), flat);
  const RotorSumsSystem by_sums(system);
  const auto local = ExpandSensitivity<kOrder, double>(by_sums, start.x, by_sums.Inputs(start.u),
                                                       segment.duration);
  return {LocalGramian<kErrors>(local, weights, segment.duration),
          local.transition.topRows(kMoving)};
}

// Gramian of the flight from this segment's start, given that from its end: W + Phi' V Phi.
Square Chain(const SegmentGramian& segment, const Square& after) {
  Square product = after;  // V Phi
  product.leftCols<kMoving>().setZero();
  product.noalias() += after.leftCols<kMoving>() * segment.transition;
  Square result = product;  // Phi' (V Phi)
  result.topRows<kMoving>().setZero();
  result.noalias() += segment.transition.transpose() * product.topRows<kMoving>();
  return result + segment.gramian;
}

template <int kOrder>
Square ChainSegments(const RotorDrivenSystem& system, const RotorFlight& flight,
                     const std::vector<double>& weights, const E2logOptions& options) {
  const std::vector<SegmentTimes> times = SplitIntoSegments(flight.path(), options.segment);
  std::vector<SegmentGramian, Eigen::aligned_allocator<SegmentGramian>> parts(times.size());
  ParallelFor(static_cast<int>(times.size()), options.threads,
              [&](int i) { parts[i] = OneSegment<kOrder>(system, flight, weights, times[i]); });
  Square total = Square::Zero();
  for (std::size_t i = parts.size(); i-- > 0;) total = Chain(parts[i], total);
  return 0.5 * (total + total.transpose());
}

}  // namespace

std::vector<SegmentTimes> SplitIntoSegments(const PiecewisePolynomial& path, double longest) {
  std::vector<SegmentTimes> segments;
  for (int piece = 0; piece < path.num_pieces(); ++piece) {
    const double length = path.breaks()[piece + 1] - path.breaks()[piece];
    const int parts = std::max(1, static_cast<int>(std::ceil(length / longest - 1e-9)));
    for (int i = 0; i < parts; ++i) {
      segments.push_back({piece, path.breaks()[piece] + i * length / parts, length / parts});
    }
  }
  return segments;
}

Eigen::MatrixXd E2log(const RotorDrivenSystem& system, const RotorFlight& flight,
                      const std::vector<double>& weights, const E2logOptions& options) {
  if (!(options.segment > 0.0)) {
    throw InputError(fmt::format("E2LOG segment of {} s; use 0.02 to 0.5 s", options.segment));
  }
  switch (options.order) {
    case 1:
      return ChainSegments<1>(system, flight, weights, options);
    case 2:
      return ChainSegments<2>(system, flight, weights, options);
    case 3:
      return ChainSegments<3>(system, flight, weights, options);
    case 4:
      return ChainSegments<4>(system, flight, weights, options);
    case 5:
      return ChainSegments<5>(system, flight, weights, options);
    case 6:
      return ChainSegments<6>(system, flight, weights, options);
    default:
      throw InputError(fmt::format("E2LOG order {}; use 1 to 6", options.order));
  }
}

}  // namespace trueline
