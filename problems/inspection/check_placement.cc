// Fixes against mocap by their positions themselves, where the two share an origin.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/fix_agreement.h"
#include "problems/inspection/vector_match.h"
#include "problems/inspection/vector_sums.h"
#include "problems/log/fixes.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kPlaced = 0.2;          // rms against the distances flown
constexpr double kPlacementStep = 0.05;  // s
constexpr int kPlacementSteps = 200;
constexpr double kFarLag = 1.0;          // s; CheckPositions() finds a shorter one
constexpr double kLeastOddSpread = 1.0;  // m

// m, rms by which the fixes differ from mocap turned by `turn`; nothing is taken out.
double AbsoluteRms(const VectorSums& sums, const Eigen::Matrix3d& turn) {
  const double square = sums.seen2 + sums.sure2 - 2.0 * turn.cwiseProduct(sums.cross).sum();
  return std::sqrt(std::max(0.0, square) / sums.n);
}

// Fixes put into mocap at a lag and by a signed permutation of the axes.
struct Placement {
  double lag = 0.0;  // s
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  double rms = std::numeric_limits<double>::infinity();  // m
  double count = 0.0;                                    // fixes that mocap covers
  std::optional<double> or_else;                         // s, another lag about as good
};

// Streams of one flight are logged together, so that a lag which leaves fixes without mocap is
// unlikely.
double Misfit(const Placement& placement) {
  return placement.rms / (placement.count * placement.count);
}

// At the best lag; laps repeat, so that another one may be about as good.
Placement BestPlacementByLag(const PairsAt& pairs, double least_count) {
  std::vector<Placement> tried;
  Placement best;
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  for (int k = -kPlacementSteps; k <= kPlacementSteps; ++k) {
    const VectorSums sums = SumOf(pairs(k * kPlacementStep));
    if (sums.n < least_count) continue;
    tried.push_back({k * kPlacementStep, one, AbsoluteRms(sums, one), sums.n, {}});
    if (best.count == 0.0 || Misfit(tried.back()) < Misfit(best)) best = tried.back();
  }
  double second = kAlikeRest * best.rms;
  for (const Placement& placement : tried) {
    if (std::abs(placement.lag - best.lag) < 1.0 || placement.rms > second) continue;
    second = placement.rms;
    best.or_else = placement.lag;
  }
  return best;
}

Placement BestPlacementByAxes(const VectorSums& sums) {
  Placement best;
  for (const Eigen::Matrix3d& turn : SignedPermutations()) {
    const double rms = AbsoluteRms(sums, turn);
    if (rms < best.rms) best = {0.0, turn, rms, sums.n, {}};
  }
  return best;
}

void AddPlacedClock(Examination* e, const Placement& placement, double as_stamped) {
  Finding finding{
      .stream = "fixes", .level = Level::kFatal, .error = e->log.gravity, .sigma = kPlacementStep};
  finding.text = fmt::format(
      "the positions of fixes.csv come {} than mocap shows: so they differ from it by {:.2f} m "
      "(rms), as stamped by {:.2f} m{}",
      LateText(placement.lag), placement.rms, as_stamped,
      placement.or_else
          ? fmt::format("; {} is nearly as good, as laps repeat", LateText(*placement.or_else))
          : "");
  AddClockOffset(e, placement.lag, finding);
}

void AddPlacedAxes(Examination* e, const Placement& placement, double as_read) {
  Finding finding{.stream = "fixes", .error = e->log.gravity};
  finding.text = fmt::format(
      "the positions of fixes.csv are in other axes: taken as {} they differ from mocap by {:.2f} "
      "m (rms), as read by {:.2f} m",
      AxesText(placement.turn.transpose()), placement.rms, as_read);
  AddPositionAxes(e, placement.turn, finding);
}

struct Spread {
  double about_median, about_mocap;  // m
};

std::array<Spread, 3> SpreadOfAxes(const std::vector<VectorPair>& pairs) {
  std::array<Spread, 3> spread;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> off;
    off.reserve(pairs.size());
    for (const VectorPair& pair : pairs) off.push_back(pair.seen[axis] - pair.sure[axis]);
    const double sigma = SigmaByMedian(off);
    spread[static_cast<std::size_t>(axis)] = {sigma, std::hypot(sigma, LowerMedian(off))};
  }
  return spread;
}

}  // namespace

// Where fixes and mocap share an origin their positions themselves show a clock, or other axes;
// laps repeat, and half a lap looks like a turn once the means are taken out.
void CheckPlacement(Examination* e) {
  const PairsAt pairs = FixPairs(e->fixed);
  const VectorSums sums = SumOf(pairs(0.0));
  if (sums.n < kFewest) return;
  const double flown = std::sqrt(sums.SureVar());
  const double as_read = AbsoluteRms(sums, Eigen::Matrix3d::Identity());
  if (as_read < kPlaced * flown) return;
  const Placement axes = BestPlacementByAxes(sums);
  const Placement lag = BestPlacementByLag(pairs, kCovers * sums.n);
  if (std::min(lag.rms, axes.rms) > kPlaced * flown) return;
  if (axes.rms < lag.rms && BringsFixesToMocap(*e, {.position = axes.turn.transpose()})) {
    AddPlacedAxes(e, axes, as_read);
  } else if (std::abs(lag.lag) > kFarLag && BringsFixesToMocap(*e, {.time_offset = -lag.lag})) {
    AddPlacedClock(e, lag, as_read);
  }
}

// One column in another unit, or from another zero: its differences from mocap are far larger than
// its sigma says, those of another axis are not. A clock or a turn would affect more than one axis.
void CheckSpread(Examination* e) {
  const std::vector<VectorPair> pairs = FixPairs(e->fixed)(0.0);
  if (pairs.size() < kFewest) return;
  const double sigma = MedianSigma(e->fixed.fixes);
  const double odd = std::max(kLeastOddSpread, kShown * sigma);
  const std::array<Spread, 3> axes = SpreadOfAxes(pairs);
  const auto [best, worst] = std::minmax_element(
      axes.begin(), axes.end(),
      [](const Spread& a, const Spread& b) { return a.about_mocap < b.about_mocap; });
  if (worst->about_mocap < odd || best->about_median > kLikely * sigma) return;
  // A zero of its own may be meant, as of heights.
  const Level level = worst->about_median < odd ? Level::kBiases : Level::kFatal;
  Finding finding{"position_spread", "fixes", level, worst->about_mocap, "m"};
  const char axis = "xyz"[worst - axes.begin()];
  finding.text =
      fmt::format("{} of fixes.csv differs by {:.3g} m from mocap.csv, another axis by {:.2g} m",
                  axis, worst->about_mocap, best->about_mocap);
  finding.remedy = "check the unit and the zero of this column, and which column is which axis";
  e->Add(finding);
}

}  // namespace trueline
