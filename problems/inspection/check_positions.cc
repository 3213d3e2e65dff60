#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "problems/common/units.h"
#include "problems/inspection/fix_pairs.h"
#include "problems/inspection/force_fit.h"
#include "problems/inspection/position_witness.h"
#include "problems/inspection/vector_sums.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kAlikeAcceleration = 0.7;  // correlation of a match
constexpr double kAlikePosition = 0.9;
constexpr double kLeastAcceleration = 0.4;  // m/s^2, rms
constexpr double kLeastAxesTurn = 10.0 * kDegree;
constexpr double kLeastPositionLag = 0.02;  // s
constexpr double kLagExplains = 0.8;        // of the residual's square that remains
constexpr double kLeastPositionScale = 0.06;
// rad, of an attitude's tilt along with the acceleration: of a pose's own, and of an AHRS that
// takes the specific force for gravity.
constexpr double kTiltOfPose = 0.3 * kDegree;
constexpr double kTiltOfAhrs = 1.5 * kDegree;
constexpr double kDriftOfFixes = 5e-3;   // s/s, beyond what errors at gates look like
constexpr double kPlaced = 0.2;          // rms against the distances flown
constexpr double kPlacementStep = 0.05;  // s
constexpr int kPlacementSteps = 200;
constexpr double kAlikePlacement = 1.5;  // of the rms
constexpr double kFarLag = 1.0;          // s; Judge() finds a shorter one
constexpr double kOddSpread = 10.0;      // sigmas that fixes scatter about mocap
constexpr double kLeastOddSpread = 1.0;  // m

// What a stream of positions was compared with.
struct Reference {
  const char* what;  // "the accelerometer"
  bool any_heading;  // whose earth may be turned about the vertical
  bool own_clock;    // the stream has no other witness of its clock
  double least_correlation;
};

bool IsHeading(const Eigen::Matrix3d& turn) {
  return turn.determinant() > 0.0 && turn(2, 2) > 0.97;
}

void AddLag(Examination* e, const std::string& stream, const VectorMatch& match,
            const Reference& reference) {
  if (std::abs(match.lag) < std::max(kLeastPositionLag, 5.0 * match.lag_sigma)) return;
  // Errors of a map, gate by gate, favour some lag a little; a clock's does so clearly.
  const double rest = 1.0 - std::pow(match.correlation, 2);
  if (rest > kLagExplains * (1.0 - std::pow(match.unshifted, 2))) return;
  Finding finding;
  finding.stream = stream;
  finding.error = match.seen_rms * std::min(1.0, 5.0 * std::abs(match.lag));
  finding.level = match.unshifted < 0.6 * match.correlation ? Level::kFatal : Level::kBiases;
  finding.sigma = match.lag_sigma;
  finding.text = fmt::format(
      "the positions of {}.csv come {} than {} shows{} (correlation {:.3f}, as stamped {:.3f})",
      stream, LateText(match.lag), reference.what,
      match.or_else ? fmt::format(", or {}, as laps repeat", LateText(*match.or_else)) : "",
      match.correlation, match.unshifted);
  if (reference.own_clock) {
    AddClockOffset(e, match.lag, finding);
    return;
  }
  finding.id = "position_late";
  finding.size = match.lag;
  finding.unit = "s";
  finding.remedy =
      "its attitude is in time: position and attitude of the poses were not measured "
      "at one time; state the position's own time";
  e->Add(finding);
}

void AddAxes(Examination* e, const std::string& stream, const VectorMatch& match,
             const Reference& reference) {
  const Eigen::Matrix3d turn = PlainTurn(match, kLeastAxesTurn);
  if (turn.isIdentity(1e-9)) return;
  // A force along an axis that reads another multiple points elsewhere.
  const double angle = TurnBetween(turn, Eigen::Matrix3d::Identity()).norm();
  if (e->HasFinding("lateral_force", "imu") && angle < kTurnOfForce) return;
  if (reference.any_heading && IsHeading(turn)) return;  // CheckHeading() judges it
  Finding finding;
  finding.stream = stream;
  finding.sigma = std::sqrt(match.turn_cov.trace()) / kDegree;
  finding.error = match.seen_rms * 2.0 * std::sin(0.5 * TurnSize(turn) * kDegree);
  finding.text = fmt::format(
      "the positions of {}.csv are in other axes: taken as {} they agree with {} to a correlation "
      "of {:.3f}, as read to {:.3f}",
      stream, AxesText(turn.transpose()), reference.what, match.correlation, match.unturned);
  AddPositionAxes(e, turn, finding);
}

bool IsOffScale(const VectorMatch& match) {
  const double least = std::abs(std::log(match.gain)) + std::log(match.correlation) -
                       5.0 * match.gain_sigma / match.gain;
  return least > 0.0 && std::abs(match.gain - 1.0) > kLeastPositionScale;
}

// Against the accelerometer, over bends `wider` times as wide as usual.
std::optional<PositionScale> ScaleByForce(const Examination& e, const std::string& stream,
                                          double wider) {
  auto witness = PositionWitnessOf(e, stream, wider);
  if (!witness) return std::nullopt;
  TurnLikePositions(e, *witness, &witness->bends);
  auto scale = FitPositionScale(BodyForce(e.fixed, witness->attitude), witness->bends);
  if (!scale) return std::nullopt;
  double squares = 0.0;
  for (const Bend& bend : witness->bends) squares += bend.acceleration.squaredNorm();
  const double rms = std::sqrt(squares / static_cast<double>(witness->bends.size()));
  // A tilt of the attitude that changes with the acceleration looks like a scale as well.
  const bool own = witness->of_attitude != "attitude" && !e.IsCopy(witness->of_attitude);
  const double tilt =
      (own ? kTiltOfPose : kTiltOfAhrs) * e.log.gravity * scale->value / rms;  // of 1
  scale->sigma = std::hypot(scale->sigma, tilt * scale->value);
  return scale;
}

// The match with the scale of ScaleByForce().
std::optional<VectorMatch> Rescaled(const Examination& e, const std::string& stream,
                                    VectorMatch match, double wider) {
  const auto scale = ScaleByForce(e, stream, wider);
  if (!scale) return std::nullopt;
  match.gain = scale->value;
  match.gain_sigma = scale->sigma;
  return match;
}

// The unit nearest to a factor whose logarithm has this sigma.
const KnownUnit* UnitWithin(double factor, double sigma) {
  constexpr double kStep = 0.05;
  const int reach = static_cast<int>(std::min(1.0, 2.0 * sigma) / kStep);
  for (int k = 0; k <= reach; ++k) {
    for (const double sign : {1.0, -1.0}) {
      const KnownUnit* unit = UnitNear("m", factor * std::exp(sign * k * kStep));
      if (unit != nullptr) return unit;
    }
  }
  return nullptr;
}

void AddPositionScale(Examination* e, const std::string& stream, const VectorMatch& match,
                      const Reference& reference) {
  if (!IsOffScale(match)) return;
  // A smoothed position has less of the fast motion; a scale changes the slow one as well.
  const bool by_force = std::string(reference.what) != "mocap";
  const auto slow = by_force ? Rescaled(*e, stream, match, 2.0) : std::optional(match);
  if (!slow || !IsOffScale(*slow)) return;
  if (std::abs(slow->gain - match.gain) > 0.3 * std::abs(match.gain - 1.0)) return;
  Finding finding;
  finding.id = "position_scale";
  finding.stream = stream;
  finding.level = Level::kBiases;
  finding.size = match.gain;
  finding.sigma = match.gain_sigma;
  finding.unit = "1";
  finding.error = match.seen_rms * std::abs(match.gain - 1.0);
  const bool after_repair = e->HasFinding("position_scale", reference.what);
  finding.text = fmt::format("distances in {}.csv are {:.3f} +- {:.3f} times those that {} shows{}",
                             stream, match.gain, match.gain_sigma, reference.what,
                             after_repair ? " once its own scale is repaired" : "");
  if (by_force && std::abs(std::log(match.gain)) < kOtherUnit) {
    // The accelerometer's scale and the attitude's tilt may err by as much.
    finding.level = Level::kWidens;
    finding.remedy = "check the unit, the accelerometer's scale and the attitude's tilt";
    e->Add(finding);
    return;
  }
  const KnownUnit* unit = UnitWithin(1.0 / match.gain, match.gain_sigma / match.gain);
  const double factor = unit != nullptr ? unit->factor : 1.0 / match.gain;
  finding.remedy =
      fmt::format("multiply the positions by {:.6g}{}; check the unit", factor, UnitText(unit));
  finding.repaired = true;
  StreamRepair change;
  change.position_scale = factor;
  // Positions in another unit scatter about mocap as well.
  if (unit != nullptr && stream == "fixes") e->Remove("position_spread");
  e->Repair(stream, change);
  e->Add(finding);
}

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
  double second = kAlikePlacement * best.rms;
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
  Finding finding;
  finding.stream = "fixes";
  finding.level = Level::kFatal;
  finding.sigma = kPlacementStep;
  finding.error = e->log.gravity;
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
  Finding finding;
  finding.stream = "fixes";
  finding.error = e->log.gravity;
  finding.text = fmt::format(
      "the positions of fixes.csv are in other axes: taken as {} they differ from mocap by {:.2f} "
      "m "
      "(rms), as read by {:.2f} m",
      AxesText(placement.turn.transpose()), placement.rms, as_read);
  AddPositionAxes(e, placement.turn, finding);
}

// Where fixes and mocap share an origin their positions themselves show a clock, or other axes;
// laps repeat, and half a lap looks like a turn once the means are taken out.
void CheckPlacement(Examination* e) {
  const PairsAt pairs = FixPairs(e->fixed);
  const VectorSums sums = SumOf(pairs(0.0));
  if (sums.n < kLeastPairs) return;
  const double flown = std::sqrt(sums.SureVar());
  const double as_read = AbsoluteRms(sums, Eigen::Matrix3d::Identity());
  const auto is_good = [&](const Placement& placement) {
    return placement.rms < kPlaced * flown && placement.rms < 0.5 * as_read;
  };
  if (as_read < kPlaced * flown) return;
  const Placement axes = BestPlacementByAxes(sums);
  const Placement lag = BestPlacementByLag(pairs, 0.5 * sums.n);
  if (is_good(lag) && std::abs(lag.lag) > kFarLag && lag.rms < 1.5 * axes.rms) {
    AddPlacedClock(e, lag, as_read);
  } else if (is_good(axes)) {
    AddPlacedAxes(e, axes, as_read);
  }
}

void Judge(Examination* e, const std::string& stream, const PairsAt& pairs, double reach,
           const Reference& reference) {
  Comparison comparison{fmt::format("positions against {}", reference.what), stream, {}, {}};
  comparison.match = MatchVectors(pairs, {reach, 0.02});
  if (!comparison.match) {
    comparison.not_shown = "they share too little time at any lag that was tried";
  } else if (comparison.match->seen_rms < kLeastAcceleration) {
    comparison.not_shown =
        fmt::format("the vehicle moves too little ({:.2f} rms)", comparison.match->seen_rms);
  } else if (comparison.match->correlation < reference.least_correlation) {
    comparison.not_shown = fmt::format("too noisy, or of another flight (correlation {:.2f})",
                                       comparison.match->correlation);
  }
  e->result.comparisons.push_back(comparison);
  if (!comparison.not_shown.empty()) return;
  AddLag(e, stream, *comparison.match, reference);
  const bool reference_drifts = e->HasFinding("clock_drift", reference.what);
  if (reference.own_clock && !reference_drifts) {
    // Errors of a map, gate by gate, look like a smaller drift.
    const double least = stream == "fixes" ? kDriftOfFixes : kOrdinaryDrift;
    AddClockDrift(e, stream, *comparison.match, reference.what, least);
  }
  AddAxes(e, stream, *comparison.match, reference);
  auto scaled = comparison.match;
  if (std::string(reference.what) != "mocap") scaled = Rescaled(*e, stream, *scaled, 1.0);
  if (!scaled) return;
  e->result.comparisons.back().match = scaled;
  AddPositionScale(e, stream, *scaled, reference);
}

// Laps repeat: mocap that was moved by a lap too many compares with fixes of another place.
bool HasAmbiguousClock(const Examination& e, const std::string& stream) {
  return std::any_of(e.rates.begin(), e.rates.end(), [&](const RateWitness& rate) {
    return rate.stream == stream && rate.match.or_else.has_value();
  });
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

// One column in another unit, or from another zero: its differences from mocap are far larger than
// its sigma says, those of another axis are not. A clock or a turn would affect more than one axis.
void CheckSpread(Examination* e) {
  const std::vector<VectorPair> pairs = FixPairs(e->fixed)(0.0);
  if (pairs.size() < 30) return;
  std::vector<double> sigmas;
  for (const Fix& fix : e->fixed.fixes) sigmas.push_back(fix.sigma);
  const double sigma = LowerMedian(sigmas), odd = std::max(kLeastOddSpread, kOddSpread * sigma);
  const std::array<Spread, 3> axes = SpreadOfAxes(pairs);
  const auto [best, worst] = std::minmax_element(
      axes.begin(), axes.end(),
      [](const Spread& a, const Spread& b) { return a.about_mocap < b.about_mocap; });
  if (worst->about_mocap < odd || best->about_median > 3.0 * sigma) return;
  Finding finding;
  finding.id = "position_spread";
  finding.stream = "fixes";
  // A zero of its own may be meant, as of heights.
  finding.level = worst->about_median < odd ? Level::kBiases : Level::kFatal;
  finding.size = worst->about_mocap;
  finding.unit = "m";
  finding.text =
      fmt::format("{} of fixes.csv differs by {:.3g} m from mocap.csv, another axis by {:.2g} m",
                  "xyz"[worst - axes.begin()], worst -> about_mocap, best -> about_mocap);
  finding.remedy = "check the unit and the zero of this column, and which column is which axis";
  e->Add(finding);
}

}  // namespace

void AddPositionAxes(Examination* e, const Eigen::Matrix3d& turn, Finding finding) {
  finding.id = "position_axes";
  finding.level = Level::kFatal;
  finding.size = TurnSize(turn);
  finding.unit = "deg";
  finding.remedy = "state the earth axes of the positions so (position: {earth: ...})";
  finding.repaired = true;
  StreamRepair change;
  change.position = turn.transpose();
  e->Repair(finding.stream, change);
  e->Add(std::move(finding));
}

void CheckPositions(Examination* e) {
  for (const char* stream : {"mocap", "pose", "fixes"}) {
    const bool fixes = std::string(stream) == "fixes";
    if (fixes && e->fixed.mocap.size() > 100) {
      const bool moved = e->HasFinding("clock_offset", "mocap");
      if (!moved) {
        CheckPlacement(e);
        CheckSpread(e);
        CheckClockJump(e);
      }
      if (moved && HasAmbiguousClock(*e, "mocap")) continue;
      Judge(e, stream, FixPairs(e->fixed), 2.0, {"mocap", false, true, kAlikePosition});
      continue;
    }
    const auto witness = PositionWitnessOf(*e, stream);
    if (!witness) continue;
    const RunningIntegral<3> force = ForceIntegral(e->fixed, witness->attitude);
    const bool copy = e->IsCopy(stream);
    Judge(e, stream, AccelerationPairs(force, witness->bends), fixes || copy ? 5.0 : 0.5,
          {"the accelerometer", fixes || copy, fixes || copy, kAlikeAcceleration});
  }
}

}  // namespace trueline
