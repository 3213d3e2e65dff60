#include "problems/observability/e2log.h"

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/common/parallel.h"
#include "problems/observability/lie_derivatives.h"

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
SegmentStart<double, kOrder> StartOf(const RotorFlight& flight, const SegmentTimes& segment) {
  const auto flat = FlatSeries<Taylor<double, kOrder + 4>>(
      flight.path().ExpandPiece(segment.piece, segment.start, kOrder + 4));
  return StartFromFlat<double, kOrder>(flight.vehicle(), flight.parameters(), flat);
}

// Polynomials in time through the inputs, by least squares on an even grid.
template <int kOrder>
SegmentStart<double, kOrder> StartOf(const NominalFlight& flight, const SegmentTimes& segment) {
  constexpr int kSamples = 4 * (kOrder + 1);
  const NominalPoint begin = flight.at(segment.start);
  Eigen::MatrixXd powers(kSamples, kOrder + 1), inputs(kSamples, begin.u.size());
  for (int k = 0; k < kSamples; ++k) {
    const double share = static_cast<double>(k) / (kSamples - 1);
    const NominalPoint point = flight.at(segment.start + share * segment.duration);
    for (int j = 0; j <= kOrder; ++j) powers(k, j) = std::pow(share, j);
    inputs.row(k) = Eigen::Map<const Eigen::RowVectorXd>(point.u.data(), inputs.cols());
  }
  const Eigen::MatrixXd fit = powers.householderQr().solve(inputs);
  SegmentStart<double, kOrder> start{begin.x, {}};
  for (Eigen::Index i = 0; i < fit.cols(); ++i) {
    auto u = Taylor<double, kOrder>::Start(fit(0, i));
    for (int j = 1; j <= kOrder; ++j) u.Append(fit(j, i) / std::pow(segment.duration, j));
    start.u.push_back(u);
  }
  return start;
}

// Appends equal parts of at most `longest`.
void Split(int piece, double start, double end, double longest,
           std::vector<SegmentTimes>* segments) {
  const double length = end - start;
  const int parts = std::max(1, static_cast<int>(std::ceil(length / longest - 1e-9)));
  for (int i = 0; i < parts; ++i) {
    segments->push_back({piece, start + i * length / parts, length / parts});
  }
}

std::vector<SegmentTimes> SegmentsOf(const RotorFlight& flight, double longest) {
  return SplitIntoSegments(flight.path(), longest);
}

std::vector<SegmentTimes> SegmentsOf(const NominalFlight& flight, double longest) {
  std::vector<SegmentTimes> segments;
  Split(0, flight.start, flight.end, longest, &segments);
  return segments;
}

template <int kOrder>
SegmentGramian OneSegment(const RotorDrivenSystem& system,
                          const SegmentStart<double, kOrder>& start,
                          const std::vector<double>& weights, double duration) {
  const RotorSumsSystem by_sums(system);
  const auto local =
      ExpandSensitivity<kOrder, double>(by_sums, start.x, by_sums.Inputs(start.u), duration);
  return {LocalGramian<kErrors, kOrder>(local, weights, duration),
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

template <int kOrder, class Flight>
Square AddSegments(const RotorDrivenSystem& system, const Flight& flight,
                   const std::vector<double>& weights, const E2logOptions& options) {
  const std::vector<SegmentTimes> times = SegmentsOf(flight, options.segment);
  std::vector<SegmentGramian, Eigen::aligned_allocator<SegmentGramian>> parts(times.size());
  ParallelFor(static_cast<int>(times.size()), options.threads, [&](int i) {
    parts[i] =
        OneSegment<kOrder>(system, StartOf<kOrder>(flight, times[i]), weights, times[i].duration);
  });
  Square total = Square::Zero();
  for (std::size_t i = parts.size(); i-- > 0;) {
    total = options.chained ? Chain(parts[i], total) : Square(total + parts[i].gramian);
  }
  return 0.5 * (total + total.transpose());
}

}  // namespace

std::vector<SegmentTimes> SplitIntoSegments(const PiecewisePolynomial& path, double longest) {
  std::vector<SegmentTimes> segments;
  for (int piece = 0; piece < path.num_pieces(); ++piece) {
    Split(piece, path.breaks()[piece], path.breaks()[piece + 1], longest, &segments);
  }
  return segments;
}

template <class Flight>
Eigen::MatrixXd E2log(const RotorDrivenSystem& system, const Flight& flight,
                      const std::vector<double>& weights, const E2logOptions& options) {
  if (!(options.segment > 0.0)) {
    throw InputError(fmt::format("E2LOG segment of {} s; use 0.02 to 0.5 s", options.segment));
  }
  switch (options.order) {
    case 1:
      return AddSegments<1>(system, flight, weights, options);
    case 2:
      return AddSegments<2>(system, flight, weights, options);
    case 3:
      return AddSegments<3>(system, flight, weights, options);
    case 4:
      return AddSegments<4>(system, flight, weights, options);
    case 5:
      return AddSegments<5>(system, flight, weights, options);
    case 6:
      return AddSegments<6>(system, flight, weights, options);
    default:
      throw InputError(fmt::format("E2LOG order {}; use 1 to 6", options.order));
  }
}

template Eigen::MatrixXd E2log(const RotorDrivenSystem&, const RotorFlight&,
                               const std::vector<double>&, const E2logOptions&);
template Eigen::MatrixXd E2log(const RotorDrivenSystem&, const NominalFlight&,
                               const std::vector<double>&, const E2logOptions&);

}  // namespace trueline
