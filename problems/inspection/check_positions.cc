#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/common/units.h"
#include "problems/inspection/position_witness.h"
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
constexpr double kNotedHeading = 20.0 * kDegree;
constexpr double kLeastClockJump = 0.15;  // s
constexpr double kOddSpread = 10.0;       // sigmas that fixes scatter about mocap
constexpr double kLeastOddSpread = 1.0;   // m
constexpr double kClearlyWorse = 1.5;     // times the residual
constexpr double kMocapGap = 0.2;         // s

// What a stream of positions was compared with.
struct Reference {
  const char* what;  // "the accelerometer"
  bool any_heading;  // whose earth may be turned about the vertical
  bool own_clock;    // the stream has no other witness of its clock
  double least_correlation;
};

std::optional<Eigen::Vector3d> MocapAt(const std::vector<PoseSample>& mocap, const LogClock& clock,
                                       double t) {
  const auto after =
      std::lower_bound(mocap.begin(), mocap.end(), t,
                       [&](const PoseSample& pose, double at) { return clock(pose.t) < at; });
  if (after == mocap.begin() || after == mocap.end()) return std::nullopt;
  const auto before = after - 1;
  const double from = clock(before->t), span = clock(after->t) - from;
  if (span > kMocapGap) return std::nullopt;
  return Eigen::Vector3d(before->p_E + (t - from) / span * (after->p_E - before->p_E));
}

// Some of the fixes, of one part in `parts`, beside mocap's position at the same time less the lag.
PairsAt FixPairs(const FlightLog& log, std::size_t part = 0, std::size_t parts = 1) {
  return [&log, part, parts](double lag) {
    const LogClock clock(log);
    std::vector<VectorPair> pairs;
    const std::size_t every = std::max<std::size_t>(1, log.fixes.size() / 1500);
    const std::size_t from = log.fixes.size() * part / parts;
    const std::size_t to = log.fixes.size() * (part + 1) / parts;
    for (std::size_t i = from; i < to; i += every) {
      const double t = clock(log.fixes[i].t);
      if (const auto p = MocapAt(log.mocap, clock, t - lag)) {
        pairs.push_back({t, log.fixes[i].p_E, *p});
      }
    }
    return pairs;
  };
}

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
  finding.id = reference.own_clock ? "clock_offset" : "position_late";
  finding.stream = stream;
  finding.error = match.seen_rms * std::min(1.0, 5.0 * std::abs(match.lag));
  finding.level = match.unshifted < 0.6 * match.correlation ? Level::kFatal : Level::kBiases;
  finding.size = match.lag;
  finding.sigma = match.lag_sigma;
  finding.unit = "s";
  finding.text = fmt::format(
      "the positions of {}.csv come {} than {} shows{} (correlation {:.3f}, as stamped {:.3f})",
      stream, LateText(match.lag), reference.what,
      match.or_else ? fmt::format(", or {}, as laps repeat", LateText(*match.or_else)) : "",
      match.correlation, match.unshifted);
  if (reference.own_clock) {
    finding.remedy = fmt::format("add {:+.3f} s to its stamps (time: offset)", -match.lag);
    finding.repaired = true;
    StreamRepair change;
    change.time_offset = -match.lag;
    e->Repair(stream, change);
  } else {
    finding.remedy =
        "its attitude is in time: position and attitude of the poses were not measured "
        "at one time; state the position's own time";
  }
  e->Add(finding);
}

void AddAxes(Examination* e, const std::string& stream, const VectorMatch& match,
             const Reference& reference) {
  const Eigen::Matrix3d turn = PlainTurn(match, kLeastAxesTurn);
  if (turn.isIdentity(1e-9)) return;
  const double angle = TurnBetween(turn, Eigen::Matrix3d::Identity()).norm();
  if (reference.any_heading && IsHeading(turn)) {
    if (angle < kNotedHeading) return;
    Finding note;
    note.id = "heading_offset";
    note.stream = "attitude";
    note.size = angle / kDegree;
    note.sigma = std::sqrt(match.turn_cov(2, 2)) / kDegree;
    note.unit = "deg";
    note.text = fmt::format("the heading of the attitude's earth is {:.0f} deg from that of {}.csv",
                            note.size, stream);
    note.remedy =
        "none where the calibration estimates the heading; else state `earth` with yaw_deg";
    e->Add(note);
    return;
  }
  Finding finding;
  finding.id = "position_axes";
  finding.stream = stream;
  const bool mirrored = turn.determinant() < 0.0;
  finding.size = mirrored ? 180.0 : angle / kDegree;
  finding.sigma = std::sqrt(match.turn_cov.trace()) / kDegree;
  finding.unit = "deg";
  finding.error = match.seen_rms * (mirrored ? 2.0 : 2.0 * std::sin(0.5 * angle));
  finding.level = Level::kFatal;
  finding.text = fmt::format(
      "the positions of {}.csv are in other axes: taken as {} they agree with {} to a correlation "
      "of {:.3f}, as read to {:.3f}",
      stream, AxesText(turn.transpose()), reference.what, match.correlation, match.unturned);
  finding.remedy = "state the earth axes of the positions so (position: {earth: ...})";
  finding.repaired = true;
  StreamRepair change;
  change.position = turn.transpose();
  e->Repair(stream, change);
  e->Add(finding);
}

bool IsOffScale(const VectorMatch& match) {
  const double least = std::abs(std::log(match.gain)) + std::log(match.correlation) -
                       5.0 * match.gain_sigma / match.gain;
  return least > 0.0 && std::abs(match.gain - 1.0) > kLeastPositionScale;
}

// Against the accelerometer, over bends twice as wide.
std::optional<VectorMatch> MatchWider(const Examination& e, const std::string& stream) {
  const auto witness = WitnessOf(e, stream, 2.0);
  if (!witness) return std::nullopt;
  const RunningIntegral<3> force = ForceIntegral(e.fixed, witness->attitude);
  return MatchVectors(AccelerationPairs(force, witness->bends), {0.0, 0.02});
}

void AddPositionScale(Examination* e, const std::string& stream, const VectorMatch& match,
                      const Reference& reference) {
  if (!IsOffScale(match)) return;
  // A smoothed position has less of the fast motion; a scale changes the slow one as well.
  const auto slow =
      std::string(reference.what) != "mocap" ? MatchWider(*e, stream) : std::optional(match);
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
  finding.text = fmt::format("distances in {}.csv are {:.3f} +- {:.3f} times those that {} shows",
                             stream, match.gain, match.gain_sigma, reference.what);
  finding.remedy =
      fmt::format("multiply the positions by {:.4f}; check the unit", 1.0 / match.gain);
  finding.repaired = true;
  StreamRepair change;
  change.position_scale = 1.0 / match.gain;
  e->Repair(stream, change);
  e->Add(finding);
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
  AddAxes(e, stream, *comparison.match, reference);
  AddPositionScale(e, stream, *comparison.match, reference);
}

// Laps repeat: at a lag that is off by a lap, positions compare with those of another place.
bool HasAmbiguousClock(const Examination& e, const std::string& stream) {
  return std::any_of(e.rates.begin(), e.rates.end(), [&](const RateWitness& rate) {
    return rate.stream == stream && rate.match.or_else.has_value();
  });
}

double SpreadOf(const std::vector<double>& values) {
  const double median = LowerMedian(values);
  std::vector<double> off;
  for (const double value : values) off.push_back(std::abs(value - median));
  return 1.4826 * LowerMedian(off);
}

// One column in another unit: its differences from mocap are far larger than its sigma says, those
// of another axis are not. A clock or a turn would spoil more than one axis.
void CheckSpread(Examination* e) {
  const std::vector<VectorPair> pairs = FixPairs(e->fixed)(0.0);
  if (pairs.size() < 30) return;
  std::vector<double> sigmas;
  for (const Fix& fix : e->fixed.fixes) sigmas.push_back(fix.sigma);
  const double sigma = LowerMedian(sigmas);
  Eigen::Vector3d spread;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> off;
    for (const VectorPair& pair : pairs) off.push_back(pair.seen[axis] - pair.sure[axis]);
    spread[axis] = SpreadOf(off);
  }
  Eigen::Index worst = 0;
  const double most = spread.maxCoeff(&worst);
  if (most < std::max(kLeastOddSpread, kOddSpread * sigma) || spread.minCoeff() > 3.0 * sigma) {
    return;
  }
  Finding finding;
  finding.id = "position_spread";
  finding.stream = "fixes";
  finding.level = Level::kFatal;
  finding.size = most;
  finding.unit = "m";
  finding.text =
      fmt::format("{} of fixes.csv scatters by {:.3g} m about mocap.csv, another axis by {:.2g} m",
                  "xyz"[worst], most, spread.minCoeff());
  finding.remedy = "check the unit of this column, and which column is which axis";
  e->Add(finding);
}

// Fixes less mocap about their mean, root mean square; without pairs enough, none.
std::optional<double> ResidualAt(const PairsAt& pairs, double lag) {
  const std::vector<VectorPair> all = pairs(lag);
  if (all.size() < 30) return std::nullopt;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const VectorPair& pair : all) mean += (pair.seen - pair.sure) / double(all.size());
  double sum = 0.0;
  for (const VectorPair& pair : all) sum += (pair.seen - pair.sure - mean).squaredNorm();
  return std::sqrt(sum / double(all.size()));
}

struct PartOfFixes {
  PairsAt pairs;
  double lag, residual;
};

// The lag that leaves the least residual, if this is far less than the distances flown.
std::optional<PartOfFixes> LagOf(const FlightLog& log, std::size_t part, std::size_t parts) {
  PartOfFixes best{FixPairs(log, part, parts), 0.0, std::numeric_limits<double>::infinity()};
  for (double lag = -1.5; lag <= 1.5; lag += 0.05) {
    const auto residual = ResidualAt(best.pairs, lag);
    if (!residual || *residual >= best.residual) continue;
    best.lag = lag;
    best.residual = *residual;
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const std::vector<VectorPair> pairs = best.pairs(best.lag);
  for (const VectorPair& pair : pairs) mean += pair.seen / double(pairs.size());
  double flown = 0.0;
  for (const VectorPair& pair : pairs) flown += (pair.seen - mean).squaredNorm();
  if (!(best.residual < 0.3 * std::sqrt(flown / double(pairs.size())))) return std::nullopt;
  return best;
}

// A clock that was set in flight, or a recorder that held fixes back: quarters of the flight
// disagree, and each fits clearly worse at the lag of the other.
void CheckClockJump(Examination* e) {
  constexpr std::size_t kParts = 4;
  std::vector<PartOfFixes> parts;
  for (std::size_t part = 0; part < kParts; ++part) {
    if (auto found = LagOf(e->fixed, part, kParts)) parts.push_back(std::move(*found));
  }
  if (parts.size() < 2) return;
  const auto [early, late] = std::minmax_element(
      parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.lag < b.lag; });
  const double jump = late->lag - early->lag;
  if (jump < kLeastClockJump) return;
  const auto worse = [](const PartOfFixes& part, double lag) {
    return ResidualAt(part.pairs, lag).value_or(0.0) > kClearlyWorse * part.residual;
  };
  if (!worse(*early, late->lag) || !worse(*late, early->lag)) return;
  Finding finding;
  finding.id = "clock_jump";
  finding.stream = "fixes";
  finding.level = Level::kBiases;
  finding.size = jump;
  finding.unit = "s";
  finding.text = fmt::format(
      "the clock of fixes.csv jumps: against mocap, quarters of the flight are {:.3f} s apart",
      jump);
  finding.remedy = "calibrate the parts before and after the jump as flights of their own";
  e->Add(finding);
}

bool HasOtherClock(const Examination& e, const std::string& stream) {
  return std::any_of(e.result.findings.begin(), e.result.findings.end(), [&](const Finding& f) {
    return f.id == "clock_offset" && f.stream == stream;
  });
}

}  // namespace

void CheckPositions(Examination* e) {
  for (const char* stream : {"mocap", "pose", "fixes"}) {
    const bool fixes = std::string(stream) == "fixes";
    if (fixes && e->fixed.mocap.size() > 100) {
      if (!HasOtherClock(*e, "mocap")) {
        CheckSpread(e);
        CheckClockJump(e);
      }
      if (HasAmbiguousClock(*e, "mocap")) continue;
      Judge(e, stream, FixPairs(e->fixed), 2.0, {"mocap", false, true, kAlikePosition});
      continue;
    }
    const auto witness = WitnessOf(*e, stream);
    if (!witness) continue;
    const RunningIntegral<3> force = ForceIntegral(e->fixed, witness->attitude);
    const bool copy = e->IsCopy(stream);
    Judge(e, stream, AccelerationPairs(force, witness->bends), fixes || copy ? 5.0 : 0.5,
          {"the accelerometer", fixes || copy, fixes || copy, kAlikeAcceleration});
  }
}

}  // namespace trueline
