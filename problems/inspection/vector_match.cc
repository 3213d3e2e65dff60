#include "problems/inspection/vector_match.h"

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <utility>

#include "cost_functions/models/rotation.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

std::vector<Eigen::Matrix3d> MakePermutations() {
  std::vector<Eigen::Matrix3d> all;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
      for (int i = 0; i < 3; ++i)
        m(i, order[static_cast<std::size_t>(i)]) = signs >> i & 1 ? -1 : 1;
      all.push_back(m);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  std::stable_sort(all.begin(), all.end(), [](const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
    return a.determinant() > b.determinant();
  });
  return all;
}

using BlocksOfSums = BlocksOf<VectorSums>;

// Zero for fewer than kFewest. `any_turn`: under the best rotation or reflection.
double Correlation(const VectorSums& sums, bool any_turn = true) {
  if (!(sums.n >= kFewest) || !(sums.Scale() > 0.0)) return 0.0;
  const Eigen::Matrix3d h = sums.Cov();
  const double shared =
      any_turn ? Eigen::JacobiSVD<Eigen::Matrix3d>(h).singularValues().sum() : h.trace();
  return shared / sums.Scale();
}

// Of one block under a given turn; NaN where it has too little.
double CorrelationUnder(const Eigen::Matrix3d& turn, const VectorSums& block) {
  if (block.n < kFewestOfPart || !(block.Scale() > 0.0)) return std::nan("");
  return (turn.transpose() * block.Cov()).trace() / block.Scale();
}

// The best one under a signed permutation of the axes.
double PlainCorrelation(const VectorSums& sums) {
  const Eigen::Matrix3d h = sums.Cov();
  double best = -1.0;
  for (const Eigen::Matrix3d& m : SignedPermutations()) {
    best = std::max(best, m.cwiseProduct(h).sum() / sums.Scale());
  }
  return best;
}

struct TurnFit {
  Eigen::Matrix3d best;      // of either handedness
  Eigen::Matrix3d mirrored;  // the best one that is no rotation
  Eigen::Matrix3d rotation;  // the best one that is a rotation
  double third;  // signed gain in correlation by the best one over a change of handedness
};

TurnFit FitTurn(const VectorSums& sums) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sums.Cov(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d &u = svd.matrixU(), &v = svd.matrixV();
  TurnFit turn;
  turn.best = u * v.transpose();
  const double sign = turn.best.determinant() > 0.0 ? 1.0 : -1.0;
  turn.rotation = u * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * v.transpose();
  turn.mirrored = u * Eigen::Vector3d(1.0, 1.0, -sign).asDiagonal() * v.transpose();
  turn.third = sign * 2.0 * svd.singularValues()[2] / sums.Scale();
  return turn;
}

// Of ten equal parts of the time from `from` to `to` (s).
BlocksOfSums BlockSums(const std::vector<VectorPair>& pairs, double from, double to) {
  BlocksOfSums blocks;
  for (const VectorPair& pair : pairs) {
    const double share = (pair.t - from) / std::max(1e-9, to - from);
    const int block = std::clamp(static_cast<int>(share * kBlocks), 0, kBlocks - 1);
    blocks[static_cast<std::size_t>(block)].Add(pair);
  }
  return blocks;
}

// A line through points of time and lag, its sigma by the scatter about it.
struct LagLine {
  double slope = 0.0;
  double sigma = std::numeric_limits<double>::infinity();
};

// Of fewer than five points no slope is known.
LagLine FitLagLine(const std::vector<Eigen::Vector2d>& points) {
  if (points.size() < 5) return {};
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  double tt = 0.0, tl = 0.0, rest = 0.0;
  for (const auto& p : points) {
    tt += std::pow(p[0] - mean[0], 2);
    tl += (p[0] - mean[0]) * (p[1] - mean[1]);
  }
  const double slope = tl / tt;
  for (const auto& p : points) rest += std::pow(p[1] - mean[1] - slope * (p[0] - mean[0]), 2);
  return {slope, std::sqrt(rest / static_cast<double>(points.size() - 2) / tt)};
}

// The middle of a block, s from the start of the flight, which lasts `span`.
double BlockMiddle(std::size_t block, double span) {
  return (static_cast<double>(block) + 0.5) * span / kBlocks;
}

// A match by one lag, and what the blocks of the flight show of it.
struct SteadyMatch {
  VectorMatch match;
  int shown = 0;                // blocks that show their lag
  double from = 0.0, to = 0.0;  // s, of the pairs
};

constexpr double kOutlier = 6.0;  // median residuals

// The lag of the best correlation on the coarse grid, and another one that is as good.
struct Peak {
  double lag = 0.0;
  std::optional<double> or_else;
};

Peak CoarsePeak(const PairsAt& pairs, const LagSearch& search) {
  std::vector<std::pair<double, VectorSums>> sums;  // by lag
  const int reach = static_cast<int>(std::round(search.reach / search.step));
  double most = 0.0;
  for (int k = -reach; k <= reach; ++k) {
    sums.emplace_back(k * search.step, SumOf(pairs(k * search.step)));
    most = std::max(most, sums.back().second.n);
  }
  std::vector<std::pair<double, double>> tried;  // lag, correlation
  double top = 0.0;
  for (const auto& [lag, sum] : sums) {
    if (2.0 * sum.n < most) continue;  // where little is left to compare, much agrees
    tried.emplace_back(lag, Correlation(sum));
    top = std::max(top, tried.back().second);
  }
  // Of lags that are as good the nearest one is the likeliest.
  std::erase_if(tried, [&](const auto& at) { return at.second < top - kClearly; });
  const auto nearest = *std::min_element(
      tried.begin(), tried.end(),
      [](const auto& a, const auto& b) { return std::abs(a.first) < std::abs(b.first); });
  Peak peak;
  double best = -1.0, other = -1.0;
  for (const auto& [lag, correlation] : tried) {
    const bool near = std::abs(lag - nearest.first) <= kNearLag;
    double& record = near ? best : other;
    if (correlation <= record) continue;
    record = correlation;
    if (near) {
      peak.lag = lag;
    } else {
      peak.or_else = lag;
    }
  }
  return peak;
}

// The sums of all blocks at three lags about a peak.
struct AtThreeLags {
  std::array<BlocksOfSums, 3> sums;

  double VertexWithout(int left_out) const {
    std::array<double, 3> c{};
    for (std::size_t k = 0; k < 3; ++k) {
      VectorSums total = Total(sums[k]);
      if (left_out >= 0) total -= sums[k][static_cast<std::size_t>(left_out)];
      c[k] = Correlation(total);
    }
    return ParabolaVertex(c[0], c[1], c[2]);
  }
  // Of one block alone, under the turn that fits the whole; NaN where it shows none.
  double VertexOf(std::size_t block, const Eigen::Matrix3d& turn) const {
    std::array<double, 3> c{};
    for (std::size_t k = 0; k < 3; ++k) {
      c[k] = CorrelationUnder(turn, sums[k][block]);
      if (std::isnan(c[k])) return c[k];
    }
    if (!(c[1] > kMajority) || !(c[0] - 2.0 * c[1] + c[2] < 0.0)) return std::nan("");
    return ParabolaVertex(c[0], c[1], c[2]);
  }
};

AtThreeLags SumsAbout(const PairsAt& pairs, double lag, double step, double from, double to) {
  AtThreeLags at;
  at.sums = {BlockSums(pairs(lag - step), from, to), BlockSums(pairs(lag), from, to),
             BlockSums(pairs(lag + step), from, to)};
  return at;
}

// Slope of the blocks' lags over time. Returns how many blocks show their lag.
int FitDrift(const AtThreeLags& at, const Eigen::Matrix3d& turn, double step, double span,
             VectorMatch* match) {
  std::vector<Eigen::Vector2d> points;
  for (std::size_t b = 0; b < kBlocks; ++b) {
    const double vertex = at.VertexOf(b, turn);
    if (std::abs(vertex) < 1.0) points.emplace_back(BlockMiddle(b, span), vertex * step);
  }
  const LagLine line = FitLagLine(points);
  match->drift = line.slope;
  match->drift_sigma = line.sigma;
  return static_cast<int>(points.size());
}

// Turn, gain and their uncertainties at the lag.
void FitTurnAndGain(const BlocksOfSums& blocks, VectorMatch* match) {
  const VectorSums total = Total(blocks);
  const TurnFit turn = FitTurn(total);
  std::vector<double> thirds, gains;
  std::vector<TurnFit> without;
  for (const VectorSums& block : blocks) {
    if (block.n == 0.0) continue;
    VectorSums rest = total;
    rest -= block;
    if (!(rest.n >= kFewest) || !(rest.Scale() > 0.0)) continue;
    without.push_back(FitTurn(rest));
    thirds.push_back(without.back().third);
    gains.push_back(std::sqrt(rest.SeenVar() / rest.SureVar()));
  }
  if (thirds.size() < 3) return;
  match->reflection = turn.third / std::max(1e-9, JackknifeSigma(thirds));
  const bool mirrored = match->reflection < -kShown && turn.third < -kClearly;
  match->turn = mirrored ? turn.best : turn.rotation;
  if (!mirrored && match->reflection < kShown) match->mirrored = turn.mirrored;
  match->gain = std::sqrt(total.SeenVar() / total.SureVar());
  match->gain_sigma = JackknifeSigma(gains);
  const double k = static_cast<double>(without.size());
  for (const TurnFit& one : without) {
    const Eigen::Matrix3d other =
        mirrored ? (one.best.determinant() < 0.0 ? one.best : one.rotation) : one.rotation;
    const Eigen::Vector3d d = TurnBetween(other, match->turn);
    match->turn_cov += (k - 1.0) / k * d * d.transpose();
  }
}

// The pairs that a fit of turn and gain explains but for at most six times the usual residual.
PairsAt WithoutOutliers(const PairsAt& pairs, double lag) {
  const std::vector<VectorPair> at = pairs(lag);
  const VectorSums sums = SumOf(at);
  if (sums.n < kFewest || !(sums.Scale() > 0.0)) return pairs;
  const Eigen::Matrix3d turn =
      std::sqrt(sums.SeenVar() / sums.SureVar()) * Correlation(sums) * FitTurn(sums).best;
  const Eigen::Vector3d seen = sums.seen / sums.n, sure = sums.sure / sums.n;
  const auto residual = [=](const VectorPair& pair) {
    return (pair.seen - seen - turn * (pair.sure - sure)).norm();
  };
  std::vector<double> residuals;
  residuals.reserve(at.size());
  for (const VectorPair& pair : at) residuals.push_back(residual(pair));
  const double limit = kOutlier * LowerMedian(residuals);
  return [=](double other) {
    std::vector<VectorPair> kept = pairs(other);
    std::erase_if(kept, [&](const VectorPair& pair) { return residual(pair) > limit; });
    return kept;
  };
}

// No value for fewer than kFewest pairs.
std::optional<SteadyMatch> MatchSteady(const PairsAt& all, const LagSearch& search) {
  SteadyMatch steady;
  VectorMatch& match = steady.match;
  const Peak peak = search.reach > 0.0 ? CoarsePeak(all, search) : Peak{};
  const PairsAt pairs = WithoutOutliers(all, peak.lag);
  match.or_else = peak.or_else;
  match.unshifted = Correlation(SumOf(pairs(0.0)));
  const std::vector<VectorPair> at_peak = pairs(peak.lag);
  if (at_peak.size() < kFewest) return std::nullopt;
  const double from = at_peak.front().t, to = at_peak.back().t;
  steady.from = from;
  steady.to = to;

  match.lag = peak.lag;
  double step = search.step;
  AtThreeLags about;
  for (int pass = 0; pass < 3 && search.reach > 0.0; ++pass) {
    about = SumsAbout(pairs, match.lag, step, from, to);
    match.lag += step * about.VertexWithout(-1);
    step = kFineStep;
  }
  about = SumsAbout(pairs, match.lag, kFineStep, from, to);
  std::vector<double> lags;
  lags.reserve(kBlocks);
  for (int block = 0; block < kBlocks; ++block) {
    lags.push_back(kFineStep * about.VertexWithout(block));
  }
  match.lag_sigma = JackknifeSigma(lags);
  const VectorSums total = Total(about.sums[1]);
  if (total.n < kFewest || !(total.Scale() > 0.0)) return std::nullopt;
  match.correlation = Correlation(total);
  match.unturned = Correlation(total, false);
  match.plain = PlainCorrelation(total);
  match.seen_rms = std::sqrt(total.SeenVar());
  FitTurnAndGain(about.sums[1], &match);
  steady.shown = FitDrift(SumsAbout(pairs, match.lag, 2.0 * kFineStep, from, to), match.turn,
                          2.0 * kFineStep, to - from, &match);
  return steady;
}

constexpr double kMostDrift = 0.01;   // s/s
constexpr int kMostDriftSteps = 100;  // each way
constexpr int kMostParts = 60;        // of the flight, each of one lag

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
    if (top == shared.begin() || top + 1 == shared.end() || !(*top > kMajority))
      return std::nan("");
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
  const double moved = std::abs(at.drift) * (to - from) / LagSearch().step;
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

// The match of a clock that drifts by more than `steady` can show, if more blocks then lie on one
// line, and it explains clearly more or each block alone confirms it.
std::optional<VectorMatch> MatchDrifting(const PairsAt& pairs, const SteadyMatch& steady,
                                         const LagSearch& search) {
  const DriftingLag coarse = CoarseDrift(SumsFarAbout(pairs, steady, search), steady.match.lag);
  if (coarse.drift == 0.0) return std::nullopt;
  const auto found = MatchSteady(WithoutDrift(pairs, coarse, steady.from, steady.to),
                                 {5.0 * search.step, search.step});
  if (!found || found->shown < steady.shown + 1) return std::nullopt;
  VectorMatch match = found->match;
  match.lag += coarse.lag;
  match.drift += coarse.drift;
  match.unshifted = steady.match.unshifted;
  match.or_else = steady.match.or_else;
  if (!(std::abs(match.drift) > kShown * match.drift_sigma)) return std::nullopt;
  const bool explains =
      RestOf(match.correlation) < (1.0 - kHardly) * RestOf(steady.match.correlation);
  return explains || Confirms(coarse.alone, match.drift) ? std::optional(match) : std::nullopt;
}

}  // namespace

std::optional<VectorMatch> MatchVectors(const PairsAt& pairs, const LagSearch& search) {
  const std::optional<SteadyMatch> steady = MatchSteady(pairs, search);
  if (!steady) return std::nullopt;
  if (search.reach > 0.0 && steady->shown < kMostly * kBlocks) {
    if (const auto drifting = MatchDrifting(pairs, *steady, search)) return drifting;
  }
  return steady->match;
}

Eigen::Vector3d TurnBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  Eigen::Matrix3d turn = a * b.transpose();
  if (turn.determinant() < 0.0) turn = -turn;
  return RotationVector(Eigen::Quaterniond(turn));
}

bool IsHeading(const Eigen::Matrix3d& turn) {
  return turn.determinant() > 0.0 && turn(2, 2) > 0.97;
}

double HeadingIn(const Eigen::Matrix3d& turn) {
  return std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1));
}

bool HasOtherScale(const VectorMatch& match) {
  const double sigma = match.gain_sigma / std::max(1.0, match.gain);
  const double least =
      std::abs(std::log(match.gain)) + std::log(match.correlation) - kShown * sigma;
  return least > 0.0 && std::abs(match.gain - 1.0) > kOtherScale;
}

bool HasSameScale(const VectorMatch& slow, const VectorMatch& match) {
  return HasOtherScale(slow) &&
         std::abs(slow.gain - match.gain) <= kLittle * std::abs(match.gain - 1.0);
}

bool Differs(const VectorMatch& match, const Eigen::Matrix3d& other, double least) {
  if ((match.turn.determinant() > 0.0) != (other.determinant() > 0.0)) return true;
  const Eigen::Vector3d turn = TurnBetween(match.turn, other);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(match.turn_cov);
  for (int i = 0; i < 3; ++i) {
    const double along = std::abs(axes.eigenvectors().col(i).dot(turn));
    const double sigma = std::sqrt(std::max(0.0, axes.eigenvalues()[i]));
    if (along > std::max(least, kShown * sigma)) return true;
  }
  return false;
}

const std::vector<Eigen::Matrix3d>& SignedPermutations() {
  static const std::vector<Eigen::Matrix3d> all = MakePermutations();
  return all;
}

Eigen::Matrix3d PlainTurn(const VectorMatch& match, double least) {
  if (!Differs(match, Eigen::Matrix3d::Identity(), least)) return Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d* best = nullptr;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Matrix3d& candidate : SignedPermutations()) {
    if (Differs(match, candidate, least)) continue;
    const double angle = TurnBetween(match.turn, candidate).norm();
    if (angle < nearest) {
      nearest = angle;
      best = &candidate;
    }
  }
  return best != nullptr ? *best : match.turn;
}

}  // namespace trueline
