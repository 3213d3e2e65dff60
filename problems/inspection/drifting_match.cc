#include "problems/inspection/drifting_match.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "problems/inspection/vector_sums.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kMostDrift = 0.01;      // s/s
constexpr int kMostDriftSteps = 100;     // each way
constexpr int kFewBlocks = 7;            // that must show a drift
constexpr int kMostParts = 60;           // of the flight, each of one lag
constexpr double kPartLag = 0.02;        // s, by which the lag may change over a part
constexpr double kDriftExplains = 0.95;  // of the residual's square that remains

// Sums of blocks at lags on both sides of a match's.
struct AtManyLags {
  int reach = 0;      // of the middle's lag and of the ends' on top of that, in steps
  double step = 0.0;  // s
  double span = 0.0;  // s, of the flight
  std::vector<BlocksOfSums> sums;

  const VectorSums& At(std::size_t block, int k) const {
    const int at = k + 2 * reach;
    return sums[static_cast<std::size_t>(at)][block];
  }
  // Of a flight whose middle has lag `lag`, and whose end has `drift` more.
  VectorSums Along(int lag, int drift) const {
    VectorSums total;
    for (std::size_t b = 0; b < kBlocks; ++b) {
      const double along = 2.0 * BlockMiddle(b, 1.0) - 1.0;
      total += At(b, lag + static_cast<int>(std::lround(drift * along)));
    }
    return total;
  }
  // The lag at which one block agrees best under the turn, in steps; NaN where that is at an end.
  double PeakOf(std::size_t block, const Eigen::Matrix3d& turn) const {
    std::vector<double> shared;
    for (int k = -2 * reach; k <= 2 * reach; ++k) {
      const double here = CorrelationUnder(turn, At(block, k));
      shared.push_back(std::isnan(here) ? -1.0 : here);
    }
    const auto top = std::max_element(shared.begin(), shared.end());
    if (top == shared.begin() || top + 1 == shared.end() || !(*top > 0.5)) return std::nan("");
    return static_cast<double>(top - shared.begin()) - 2.0 * reach +
           ParabolaVertex(*(top - 1), *top, *(top + 1));
  }
};

AtManyLags SumsFarAbout(const PairsAt& pairs, const SteadyMatch& steady, const LagSearch& search) {
  AtManyLags at;
  at.span = steady.to - steady.from;
  at.step = search.step;
  const double ends = 0.5 * at.span * kMostDrift;  // s
  at.reach = std::min(kMostDriftSteps,
                      static_cast<int>(std::round(std::min(search.reach, ends) / search.step)));
  for (int k = -2 * at.reach; k <= 2 * at.reach; ++k) {
    at.sums.push_back(BlockSums(pairs(steady.match.lag + k * at.step), steady.from, steady.to));
  }
  return at;
}

struct DriftingLag {
  double lag = 0.0;    // s, in the middle of the flight
  double drift = 0.0;  // s/s
  LagLine alone;       // through the lags at which each block agrees best by itself
};

// Of the best correlation of all blocks together, each at the lag that the drift gives it. The
// drift goes in steps that move the ends of the flight by one step of the search.
DriftingLag CoarseDrift(const AtManyLags& at, double middle) {
  int best_lag = 0, best_drift = 0;
  double top = 0.0;
  for (int drift = -at.reach; drift <= at.reach; ++drift) {
    for (int lag = -at.reach; lag <= at.reach; ++lag) {
      const double here = Correlation(at.Along(lag, drift));
      if (here <= top) continue;
      top = here;
      best_lag = lag;
      best_drift = drift;
    }
  }
  DriftingLag best{middle + best_lag * at.step, 2.0 * best_drift * at.step / at.span, {}};
  if (best_drift == 0) return best;
  const Eigen::Matrix3d turn = FitTurn(at.Along(best_lag, best_drift)).best;
  std::vector<Eigen::Vector2d> peaks;
  for (std::size_t b = 0; b < kBlocks; ++b) {
    const double peak = at.PeakOf(b, turn);
    if (std::isfinite(peak)) peaks.emplace_back(BlockMiddle(b, at.span), peak * at.step);
  }
  best.alone = FitLagLine(peaks);
  return best;
}

// The pairs of a stream whose lag grows by the drift, as if it did not; what is asked for is a lag
// more than that of `at`.
PairsAt WithoutDrift(const PairsAt& pairs, const DriftingLag& at, double from, double to) {
  const double moved = std::abs(at.drift) * (to - from) / kPartLag;
  const int parts = std::clamp(static_cast<int>(std::ceil(moved)), kBlocks, kMostParts);
  return [=](double more) {
    std::vector<VectorPair> kept;
    const double length = (to - from) / parts;
    for (int part = 0; part < parts; ++part) {
      const double middle = from + (part + 0.5) * length;
      const double lag = at.lag + more + at.drift * (middle - 0.5 * (from + to));
      for (const VectorPair& pair : pairs(lag)) {
        const int of = std::clamp(static_cast<int>((pair.t - from) / length), 0, parts - 1);
        if (of == part) kept.push_back(pair);
      }
    }
    return kept;
  };
}

// Whether the blocks' own lags, which noise may put anywhere, lie on a line of this slope.
bool Confirms(const LagLine& alone, double drift) {
  return std::abs(alone.slope) > kShown * alone.sigma &&
         std::abs(alone.slope - drift) < 0.2 * std::abs(drift);
}

}  // namespace

std::optional<VectorMatch> MatchDrifting(const PairsAt& pairs, const SteadyMatch& steady,
                                         const LagSearch& search) {
  const DriftingLag coarse = CoarseDrift(SumsFarAbout(pairs, steady, search), steady.match.lag);
  if (coarse.drift == 0.0) return std::nullopt;
  const auto found = MatchSteady(WithoutDrift(pairs, coarse, steady.from, steady.to),
                                 {5.0 * search.step, search.step});
  if (!found || found->shown < std::max(kFewBlocks, steady.shown + 1)) return std::nullopt;
  VectorMatch match = found->match;
  match.lag += coarse.lag;
  match.drift += coarse.drift;
  match.unshifted = steady.match.unshifted;
  match.or_else = steady.match.or_else;
  if (!(std::abs(match.drift) > kShown * match.drift_sigma)) return std::nullopt;
  const auto rest = [](const VectorMatch& m) { return 1.0 - m.correlation * m.correlation; };
  const bool explains = rest(match) < kDriftExplains * rest(steady.match);
  return explains || Confirms(coarse.alone, match.drift) ? std::optional(match) : std::nullopt;
}

}  // namespace trueline
