// How well fixes agree with mocap, and whether a repair makes them agree better.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>

#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/position_witness.h"
#include "problems/inspection/vector_match.h"
#include "problems/log/samples.h"
#include "problems/result/statistics.h"
#include "problems/trajectory/mocap_path.h"

namespace trueline {
namespace {

// What a fix differs from mocap by.
struct Off {
  int gate;
  Eigen::Vector3d off;  // m
};
using Offs = std::vector<Off>;

Eigen::Vector3d MedianOf(std::span<const Off> offs) {
  Eigen::Vector3d median;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(offs.size());
    for (const Off& one : offs) values.push_back(one.off[axis]);
    median[axis] = LowerMedian(values);
  }
  return median;
}

using Middles = std::map<int, Eigen::Vector3d>;

std::map<int, Offs> ByGate(const Offs& offs) {
  std::map<int, Offs> gates;
  for (const Off& one : offs) gates[one.gate].push_back(one);
  return gates;
}

// The displacement of each gate, or of all of them.
Middles MiddlesOf(const Offs& offs, bool by_gate) {
  Middles middles;
  const Eigen::Vector3d of_all = MedianOf(offs);
  for (const auto& [gate, own] : ByGate(offs)) middles[gate] = by_gate ? MedianOf(own) : of_all;
  return middles;
}

// m, median distance from these displacements.
double Spread(std::span<const Off> offs, const Middles& middles) {
  std::vector<double> distances;
  distances.reserve(offs.size());
  for (const Off& one : offs) distances.push_back((one.off - middles.at(one.gate)).norm());
  return LowerMedian(distances);
}

// Fixes that mocap covers, before and after a change; `changed`: the same of those that change.
struct Side {
  Offs all, changed;
};
struct Change {
  Side before, after;
  Offs others;  // fixes that stay as they are
};

Change ChangeOf(const FlightLog& log, const std::vector<Fix>& fixes,
                const std::vector<Fix>& changed) {
  Change change;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const Fix &old = fixes[i], &now = changed[i];
    const auto was = PositionAt(log.mocap, old.t), is = PositionAt(log.mocap, now.t);
    if (!was || !is) continue;
    change.before.all.push_back({old.gate, old.p_E - *was});
    change.after.all.push_back({now.gate, now.p_E - *is});
    if (old.t == now.t && old.p_E == now.p_E) {
      change.others.push_back(change.after.all.back());
      continue;
    }
    change.before.changed.push_back(change.before.all.back());
    change.after.changed.push_back(change.after.all.back());
  }
  return change;
}

double SpreadOf(const Side& side, bool by_gate) {
  return Spread(side.changed, MiddlesOf(side.all, by_gate));
}

bool IsSmallerInHalves(const Change& change) {
  const std::size_t half = change.before.changed.size() / 2;
  const std::span<const Off> before(change.before.changed), after(change.after.changed);
  const Middles was = MiddlesOf(change.before.all, false), is = MiddlesOf(change.after.all, false);
  return Spread(after.first(half), is) < Spread(before.first(half), was) &&
         Spread(after.subspan(half), is) < Spread(before.subspan(half), was);
}

// A part of the fixes that is right agrees with mocap as well as the others do.
bool FitsLikeOthers(const Change& change) {
  if (change.others.size() < kFewestOfPart) return true;
  return SpreadOf(change.after, false) <
         kLikely * Spread(change.others, MiddlesOf(change.after.all, false));
}

std::vector<Fix> Later(std::vector<Fix> fixes, double seconds) {
  for (Fix& fix : fixes) fix.t += FromSeconds(seconds);
  return fixes;
}

// At the lag that brings more than half of the fixes nearest to mocap.
Offs OffsAtBestLag(const FlightLog& log) {
  Offs best;
  double least = std::numeric_limits<double>::infinity();
  const int reach = static_cast<int>(std::round(kFixLagReach / LagSearch().step));
  for (int k = -reach; k <= reach; ++k) {
    Offs tried = ChangeOf(log, log.fixes, Later(log.fixes, -k * LagSearch().step)).after.all;
    if (tried.size() < kMostly * static_cast<double>(log.fixes.size())) continue;
    const double spread = Spread(tried, MiddlesOf(tried, false));
    if (spread >= least) continue;
    least = spread;
    best = std::move(tried);
  }
  return best;
}

void NoteGate(Examination* e, int gate, const Eigen::Vector3d& apart) {
  e->Add({&fault::kGateApart, "fixes", Level::kNote, apart.norm()},
         fmt::format("fixes of gate {} differ from mocap by ({:.2f}, {:.2f}, {:.2f}) m more than "
                     "those of other "
                     "gates; they are not compared with other streams",
                     gate, apart.x(), apart.y(), apart.z()),
         "check this gate's place on the map; trueline diagnose tells more");
}

// Whether a change brings the fixes nearer to mocap; before and after it, one for one those of
// `e.fixed`.
bool BringsFixesToMocap(const Examination& e, const std::vector<Fix>& before,
                        const std::vector<Fix>& changed) {
  const Change change = ChangeOf(e.fixed, before, changed);
  if (change.before.changed.size() < kFewestOfPart || !IsSmallerInHalves(change)) return false;
  if (!FitsLikeOthers(change)) return false;
  const double after = SpreadOf(change.after, false);
  const double by_gates = SpreadOf(change.before, true);
  const auto clearly = [](double less, double more) {
    return less * less < kExplains * more * more;
  };
  return clearly(after, SpreadOf(change.before, false)) &&
         (after < kAlikeRest * by_gates || clearly(SpreadOf(change.after, true), by_gates));
}

// Fixes against mocap by their positions themselves, where the two share an origin.

constexpr double kPlaced = 0.2;          // rms against the distances flown
constexpr int kPlacementSteps = 200;     // of lags, each way
constexpr double kLeastOddSpread = 1.0;  // m

// m^2, mean square by which the fixes differ from mocap turned by `turn`; nothing is taken out.
double SquareApart(const VectorSums& sums, const Eigen::Matrix3d& turn) {
  const double square = sums.seen2 + sums.sure2 - 2.0 * turn.cwiseProduct(sums.cross).sum();
  return std::max(0.0, square) / sums.n;
}

// Fixes put into mocap at a lag and by a signed permutation of the axes.
struct Placement {
  double lag = 0.0;  // s
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  double rms = std::numeric_limits<double>::infinity();  // m
  double count = 0.0;                                    // fixes that mocap covers
  std::optional<double> or_else = {};                    // s, another lag about as good

  Placement() = default;
  Placement(double at, const Eigen::Matrix3d& by, const VectorSums& sums)
      : lag(at), turn(by), rms(std::sqrt(SquareApart(sums, by))), count(sums.n) {}
  // Streams of one flight are logged together, so that a lag which leaves fixes without mocap is
  // unlikely.
  double Misfit() const { return count > 0.0 ? rms / (count * count) : rms; }
};

// At the best lag; laps repeat, so that another one may be about as good.
Placement BestPlacementByLag(const PairsAt& pairs, double least_count) {
  std::vector<Placement> tried;
  Placement best;
  for (int k = -kPlacementSteps; k <= kPlacementSteps; ++k) {
    const VectorSums sums = SumOf(pairs(k * kCoarseStep));
    if (sums.n < least_count) continue;
    tried.emplace_back(k * kCoarseStep, Eigen::Matrix3d::Identity(), sums);
    if (tried.back().Misfit() < best.Misfit()) best = tried.back();
  }
  double second = kAlikeRest * best.rms;
  for (const Placement& placement : tried) {
    if (std::abs(placement.lag - best.lag) < kFarLag || placement.rms > second) continue;
    second = placement.rms;
    best.or_else = placement.lag;
  }
  return best;
}

Placement BestPlacementByAxes(const VectorSums& sums) {
  Placement best;
  for (const Eigen::Matrix3d& turn : SignedPermutations()) {
    const Placement tried(0.0, turn, sums);
    if (tried.rms < best.rms) best = tried;
  }
  return best;
}

void AddPlacedClock(Examination* e, const Placement& placement, double as_stamped) {
  AddClockOffset(
      e, placement.lag,
      {.stream = "fixes", .level = Level::kFatal, .error = e->log.gravity, .sigma = kCoarseStep},
      fmt::format("the positions of fixes.csv come {} than mocap shows: so they differ from it by "
                  "{:.2f} m (rms), as stamped by {:.2f} m{}",
                  LateText(placement.lag), placement.rms, as_stamped,
                  placement.or_else ? fmt::format("; {} is nearly as good, as laps repeat",
                                                  LateText(*placement.or_else))
                                    : ""));
}

void AddPlacedAxes(Examination* e, const Placement& placement, double as_read) {
  AddPositionAxes(e, placement.turn, {.stream = "fixes", .error = e->log.gravity},
                  fmt::format("the positions of fixes.csv are in other axes: taken as {} they "
                              "differ from mocap by {:.2f} m (rms), as read by {:.2f} m",
                              AxesText(placement.turn.transpose()), placement.rms, as_read));
}

struct AxisSpread {
  double about_median, about_mocap;  // m
};

std::array<AxisSpread, 3> SpreadOfAxes(const std::vector<VectorPair>& pairs) {
  std::array<AxisSpread, 3> spread;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> off;
    for (const VectorPair& pair : pairs) off.push_back(pair.seen[axis] - pair.sure[axis]);
    const double sigma = SigmaByMedian(off);
    spread[static_cast<std::size_t>(axis)] = {sigma, std::hypot(sigma, LowerMedian(off))};
  }
  return spread;
}

// A clock that was set in flight, or a recorder that held fixes back: a part of the fixes fits
// mocap at another lag than the rest.

constexpr std::size_t kCoarseParts = 16;

// One part of the fixes at a lag, the rest at another one. Indices of fixes and lags.
struct Division {
  std::size_t from = 0, to = 0, lag = 0, rest_lag = 0;
};

class LaggedFixes {
 public:
  explicit LaggedFixes(const FlightLog& log) {
    const PairsAt pairs_at = FixPairs(log);
    for (const VectorPair& pair : pairs_at(0.0)) times_.push_back(pair.t);
    const int reach = static_cast<int>(std::round(kFixLagReach / kCoarseStep));
    for (int k = -reach; k <= reach; ++k) {
      lags_.push_back(k * kCoarseStep);
      upto_.push_back(UpTo(pairs_at(lags_.back())));
    }
  }

  std::size_t size() const { return times_.size(); }
  double time(std::size_t i) const { return times_[i]; }
  double lag(std::size_t k) const { return lags_[k]; }
  std::size_t lags() const { return lags_.size(); }

  // Mean square of both parts about their common mean: the frames may differ by a constant.
  double MeanSquare(const Division& d) const {
    VectorSums part = upto_[d.lag][d.to], rest = upto_[d.rest_lag].back();
    part -= upto_[d.lag][d.from];
    (rest -= upto_[d.rest_lag][d.to]) += upto_[d.rest_lag][d.from];
    if (std::min(part.n, rest.n) < kFewestOfPart) return std::numeric_limits<double>::infinity();
    part += rest;
    return SquareApart(part, Eigen::Matrix3d::Identity()) -
           ((part.seen - part.sure) / part.n).squaredNorm();
  }

 private:
  // Sums over the fixes before each; a fix without mocap at this lag adds nothing.
  std::vector<VectorSums> UpTo(const std::vector<VectorPair>& pairs) const {
    std::vector<VectorSums> sums = {VectorSums()};
    std::size_t next = 0;
    for (const double t : times_) {
      VectorSums sum = sums.back();
      while (next < pairs.size() && pairs[next].t < t) ++next;
      if (next < pairs.size() && pairs[next].t == t) sum.Add(pairs[next]);
      sums.push_back(sum);
    }
    return sums;
  }

  std::vector<double> times_, lags_;
  std::vector<std::vector<VectorSums>> upto_;
};

void KeepBetter(const LaggedFixes& fixes, const Division& tried, double* least, Division* best) {
  const double cost = fixes.MeanSquare(tried);
  if (cost >= *least) return;
  *least = cost;
  *best = tried;
}

// Over all runs of sixteenths of the fixes and all pairs of lags; then the ends fix by fix.
Division BestDivision(const LaggedFixes& fixes) {
  Division best;
  double least = std::numeric_limits<double>::infinity();
  const auto end_of = [&](std::size_t part) { return fixes.size() * part / kCoarseParts; };
  for (std::size_t from = 0; from < kCoarseParts; ++from) {
    for (std::size_t to = from + 1; to <= kCoarseParts; ++to) {
      for (std::size_t lag = 0; lag < fixes.lags(); ++lag) {
        for (std::size_t rest = 0; rest < fixes.lags(); ++rest) {
          KeepBetter(fixes, {end_of(from), end_of(to), lag, rest}, &least, &best);
        }
      }
    }
  }
  Division tried = best;
  for (tried.from = 0; tried.from < best.to; ++tried.from) {
    KeepBetter(fixes, tried, &least, &best);
  }
  tried = best;
  for (tried.to = best.from + 1; tried.to <= fixes.size(); ++tried.to) {
    KeepBetter(fixes, tried, &least, &best);
  }
  return best;
}

// The fixes, the part moved by one lag and the rest by another.
std::vector<Fix> Moved(const FlightLog& log, const LaggedFixes& lagged, const Division& d,
                       std::size_t lag, std::size_t rest_lag) {
  std::vector<Fix> fixes = log.fixes;
  const LogClock clock(log);
  for (Fix& fix : fixes) {
    const double t = clock(fix.t);
    const bool in_part = t >= lagged.time(d.from) && t <= lagged.time(d.to - 1);
    fix.t -= FromSeconds(lagged.lag(in_part ? lag : rest_lag));
  }
  return fixes;
}

// Each of the two comes nearer to mocap at its own lag than at that of the other.
bool IsJump(const Examination& e, const LaggedFixes& fixes, const Division& d) {
  const auto moved = [&](std::size_t lag, std::size_t rest) {
    return Moved(e.fixed, fixes, d, lag, rest);
  };
  const std::vector<Fix> own = moved(d.lag, d.rest_lag);
  return std::abs(fixes.lag(d.lag) - fixes.lag(d.rest_lag)) > kHarmless + 0.5 * kCoarseStep &&
         BringsFixesToMocap(e, moved(d.rest_lag, d.rest_lag), own) &&
         BringsFixesToMocap(e, moved(d.lag, d.lag), own);
}

}  // namespace

void LeaveOutGatesApart(Examination* e) {
  if (e->fixed.fixes.size() < kFewestOfPart) return;
  const Offs offs = OffsAtBestLag(e->fixed);
  if (offs.size() < kFewestOfPart) return;
  const Eigen::Vector3d middle = MedianOf(offs);
  const double spread = Spread(offs, MiddlesOf(offs, false)), sigma = MedianSigma(e->fixed.fixes);
  if (spread > kLikely * sigma) return;  // most fixes differ by more than a lag
  const double usual = std::max(spread, sigma);
  for (const auto& [gate, own] : ByGate(offs)) {
    const Eigen::Vector3d apart = MedianOf(own) - middle;
    if (2 * own.size() < kFewestOfPart || apart.norm() < kLikely * usual) continue;
    NoteGate(e, gate, apart);
    std::erase_if(e->fixed.fixes, [id = gate](const Fix& fix) { return fix.gate == id; });
  }
}

bool BringsFixesToMocap(const Examination& e, const StreamRepair& change) {
  FlightLog changed;
  changed.fixes = e.fixed.fixes;
  ApplyRepair("fixes", change, e.sources, &changed);
  return BringsFixesToMocap(e, e.fixed.fixes, changed.fixes);
}

// Where fixes and mocap share an origin their positions themselves show a clock, or other axes;
// laps repeat, and half a lap looks like a turn once the means are taken out.
void CheckPlacement(Examination* e) {
  const PairsAt pairs = FixPairs(e->fixed);
  const VectorSums sums = SumOf(pairs(0.0));
  if (sums.n < kFewest) return;
  const double placed = kPlaced * std::sqrt(sums.SureVar());
  const double as_read = Placement(0.0, Eigen::Matrix3d::Identity(), sums).rms;
  if (as_read < placed) return;
  const Placement axes = BestPlacementByAxes(sums);
  const Placement lag = BestPlacementByLag(pairs, kMostly * sums.n);
  if (std::min(lag.rms, axes.rms) > placed) return;
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
  const std::array<AxisSpread, 3> axes = SpreadOfAxes(pairs);
  const auto [best, worst] = std::ranges::minmax_element(axes, {}, &AxisSpread::about_mocap);
  if (worst->about_mocap < odd || best->about_median > kLikely * sigma) return;
  // A zero of its own may be meant, as of heights.
  const Level level = worst->about_median < odd ? Level::kBiases : Level::kFatal;
  e->Add({&fault::kPositionSpread, "fixes", level, worst->about_mocap},
         fmt::format("{} of fixes.csv differs by {:.3g} m from mocap.csv, another axis by {:.2g} m",
                     "xyz"[worst - axes.begin()], worst -> about_mocap, best -> about_mocap),
         "check the unit and the zero of this column, and which column is which axis");
}

void CheckClockJump(Examination* e) {
  const LaggedFixes fixes(e->fixed);
  if (fixes.size() < 2 * kFewestOfPart) return;
  const Division best = BestDivision(fixes);
  if (best.to == 0 || !IsJump(*e, fixes, best)) return;
  const double jump = fixes.lag(best.lag) - fixes.lag(best.rest_lag);
  e->Add({&fault::kClockJump, "fixes", Level::kBiases, jump},
         fmt::format("the clock of fixes.csv jumps: against mocap, fixes from {:.2f} to {:.2f} s "
                     "come {} than the others",
                     fixes.time(best.from), fixes.time(best.to - 1), LateText(jump)),
         "calibrate the parts before and after the jump as flights of their own");
}

}  // namespace trueline
