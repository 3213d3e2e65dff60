#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/force_fit.h"
#include "problems/inspection/position_witness.h"
#include "problems/inspection/vector_match.h"

namespace trueline {
namespace {

// What a stream of positions was compared with.
struct Reference {
  const char* what;  // "the accelerometer"
  bool any_heading;  // whose earth may be turned about the vertical
  bool own_clock;    // the stream has no other witness of its clock
  double least_correlation;
  const PositionWitness* of_ahrs = nullptr;  // where an AHRS turned the accelerometer
};

// Repeats the match after removing the lag of an AHRS that follows acceleration; none if the filter
// explains as much without a lag.
std::optional<VectorMatch> BesideFilter(Examination* e, const PositionWitness& witness,
                                        VectorMatch match) {
  const auto as_stamped = FollowingOf(*e, witness, 0.0);
  if (as_stamped && RestOf(match.correlation) > kExplains * RestOf(as_stamped->match.correlation)) {
    e->result.notes.push_back(fmt::format(
        "the clock of {}.csv: its positions come {} than the accelerometer shows if the attitude "
        "filter is in order; one that takes acceleration for tilt with a gain of {:.2g} 1/s "
        "(ahrs_acceleration_error) explains as much",
        witness.stream, LateText(match.lag), as_stamped->gain));
    return std::nullopt;
  }
  const auto beside = FollowingOf(*e, witness, std::abs(match.lag) + kPlaceClock.lag);
  if (!beside || beside->match.correlation < match.correlation) return match;
  match.lag_sigma = std::hypot(match.lag_sigma, 0.5 * (match.lag - beside->match.lag));
  match.lag = beside->match.lag;
  return match;
}

bool IsLate(const VectorMatch& match) {
  if (std::abs(match.lag) < std::max(kPlaceClock.lag, kShown * match.lag_sigma)) return false;
  // Errors of a map, gate by gate, favour some lag a little; a clock's does so clearly.
  return RestOf(match.correlation) < kExplains * RestOf(match.unshifted);
}

bool IsMocap(const Reference& reference) { return std::string(reference.what) == "mocap"; }

// Whether mocap, where it is the reference, confirms a repair.
bool IsConfirmed(const Examination& e, const Reference& reference, const StreamRepair& change) {
  return !IsMocap(reference) || BringsFixesToMocap(e, change);
}

// A lag may show only once the axes are turned as well.
bool IsConfirmedLag(const Examination& e, const Reference& reference, const VectorMatch& match) {
  const Eigen::Matrix3d turn = PlainTurn(match, kOtherAxes).transpose();
  return IsConfirmed(e, reference, {.time_offset = -match.lag}) ||
         (!IsConfirmed(e, reference, {.position = turn}) &&
          IsConfirmed(e, reference, {.time_offset = -match.lag, .position = turn}));
}

void AddLag(Examination* e, const std::string& stream, VectorMatch match,
            const Reference& reference) {
  if (!IsLate(match) || !IsConfirmedLag(*e, reference, match)) return;
  if (reference.of_ahrs != nullptr) {
    const auto beside = BesideFilter(e, *reference.of_ahrs, match);
    if (!beside || !IsLate(*beside)) return;
    match = *beside;
  }
  const std::string text = fmt::format(
      "the positions of {}.csv come {} than {} shows{} (correlation {:.3f}, as stamped {:.3f})",
      stream, LateText(match.lag), reference.what, OrElseText(match), match.correlation,
      match.unshifted);
  const double error = match.seen_rms * std::min(1.0, 5.0 * std::abs(match.lag));
  const Finding finding{&fault::kPositionLate, stream, LevelOfLag(match, error), match.lag, error,
                        match.lag_sigma};
  if (reference.own_clock) return AddClockOffset(e, match.lag, finding, text);
  e->Add(finding, text,
         "its attitude is in time: position and attitude of the poses were not measured at one "
         "time; state the position's own time");
}

void AddAxes(Examination* e, const std::string& stream, const VectorMatch& match,
             const Reference& reference) {
  const Eigen::Matrix3d turn = PlainTurn(match, kOtherAxes);
  if (turn.isIdentity(1e-9)) return;
  if (!IsConfirmed(*e, reference, {.position = turn.transpose()})) return;
  if (TurnBetween(turn, Eigen::Matrix3d::Identity()).norm() < e->other_axes) return;
  if (reference.any_heading && IsHeading(turn)) return;  // CheckHeading() judges it
  AddPositionAxes(
      e, turn,
      {.stream = stream,
       .error = match.seen_rms * 2.0 * std::sin(0.5 * TurnSize(turn) * kDegree),
       .sigma = std::sqrt(match.turn_cov.trace()) / kDegree},
      fmt::format("the positions of {}.csv are in other axes: taken as {} they agree with {} to a "
                  "correlation of {:.3f}, as read to {:.3f}",
                  stream, AxesText(turn.transpose()), reference.what, match.correlation,
                  match.unturned));
}

// Against the accelerometer, over bends `wider` times as wide as usual.
std::optional<PositionScale> ScaleByForce(const Examination& e, const std::string& stream,
                                          double wider) {
  auto witness = PositionWitnessOf(e, stream, wider);
  if (!witness) return std::nullopt;
  TurnLikePositions(e, *witness, &witness->bends);
  auto scale = FitPositionScale(BodyForce(e.fixed, witness->attitude), witness->bends);
  if (!scale) return std::nullopt;
  // A tilt of the attitude that changes with the acceleration looks like a scale as well: an AHRS
  // takes the specific force for gravity, a pose errs little.
  const double tilt = IsOfAhrs(e, *witness) ? kBodyBias : kForceNoise;  // m/s^2, of gravity
  const double share = tilt * scale->value / RmsAcceleration(witness->bends);
  scale->sigma = std::hypot(scale->sigma, share * scale->value);
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

void AddPositionScale(Examination* e, const std::string& stream, const VectorMatch& match,
                      const Reference& reference) {
  if (!HasOtherScale(match)) return;
  // A smoothed position has less of the fast motion; a scale changes the slow one as well.
  const bool by_force = !IsMocap(reference);
  const auto slow = by_force ? Rescaled(*e, stream, match, 2.0) : std::optional(match);
  if (!slow || !HasSameScale(*slow, match)) return;
  if (!IsConfirmed(*e, reference, {.position_scale = 1.0 / match.gain})) return;
  const double error = match.seen_rms * std::abs(match.gain - 1.0);
  Finding finding{&fault::kPositionScale, stream, Level::kBiases, match.gain, error,
                  match.gain_sigma};
  const bool after_repair = e->RepairOf(reference.what).position_scale != 1.0;
  const std::string text = fmt::format(
      "distances in {}.csv are {:.3f} +- {:.3f} times those that {} shows{}", stream, match.gain,
      match.gain_sigma, reference.what, after_repair ? " once its own scale is repaired" : "");
  if (by_force && std::abs(std::log(match.gain)) < kOtherUnit) {
    // The accelerometer's scale and the attitude's tilt may err by as much.
    finding.level = Level::kWidens;
    e->Add(finding, text, "check the unit, the accelerometer's scale and the attitude's tilt");
    return;
  }
  const KnownUnit* unit =
      UnitNear("m", 1.0 / match.gain, std::min(1.0, 2.0 * match.gain_sigma / match.gain));
  AddScale(e, &StreamRepair::position_scale, 1.0 / match.gain, unit, finding, text);
}

void Judge(Examination* e, const std::string& stream, const PairsAt& pairs, double reach,
           const Reference& reference) {
  MotionComparison comparison{fmt::format("positions against {}", reference.what), stream, {}, {}};
  comparison.match = MatchVectors(pairs, {reach});
  if (!comparison.match) {
    comparison.not_shown = "they share too little time at any lag that was tried";
  } else if (comparison.match->seen_rms < kForceError) {
    comparison.not_shown =
        fmt::format("the vehicle moves too little ({:.2f} rms)", comparison.match->seen_rms);
  } else if (comparison.match->correlation < reference.least_correlation) {
    comparison.not_shown = fmt::format("too noisy, or of another flight (correlation {:.2f})",
                                       comparison.match->correlation);
  }
  e->result.comparisons.push_back(comparison);
  if (!comparison.not_shown.empty()) return;
  AddLag(e, stream, *comparison.match, reference);
  if (reference.own_clock && !e->Drifts(reference.what)) {
    // Errors of a map, gate by gate, look like a smaller drift.
    const double least = stream == "fixes" ? kFixClock.drift : kPlaceClock.drift;
    AddClockDrift(e, stream, *comparison.match, reference.what, least);
  }
  AddAxes(e, stream, *comparison.match, reference);
  auto scaled = comparison.match;
  const bool by_force = !IsMocap(reference);
  if (by_force && !ReadsGravity(e->fixed)) {
    e->result.notes.push_back(fmt::format(
        "the scale of distances in {}.csv is not shown: the accelerometer is in another unit, or "
        "reads no gravity",
        stream));
    return;
  }
  if (by_force) scaled = Rescaled(*e, stream, *scaled, 1.0);
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

}  // namespace

void AddPositionAxes(Examination* e, const Eigen::Matrix3d& turn, Finding finding,
                     const std::string& text) {
  finding.kind = &fault::kPositionAxes;
  finding.level = Level::kFatal;
  finding.size = TurnSize(turn);
  e->AddRepaired(std::move(finding), text,
                 "state the earth axes of the positions so (position: {earth: ...})",
                 {.position = turn.transpose()});
}

void CheckPositions(Examination* e) {
  for (const char* stream : {"mocap", "pose", "fixes"}) {
    const bool fixes = std::string(stream) == "fixes";
    if (fixes && e->fixed.mocap.size() >= kFewest) {
      const bool moved = e->RepairOf("mocap").time_offset != 0.0;
      LeaveOutGatesApart(e);
      if (!moved) {
        CheckPlacement(e);
        CheckClockJump(e);
      }
      if (moved && HasAmbiguousClock(*e, "mocap")) continue;
      Judge(e, stream, FixPairs(e->fixed), kFixLagReach, {"mocap", false, true, kSound});
      if (!moved) CheckSpread(e);
      continue;
    }
    const auto witness = PositionWitnessOf(*e, stream);
    if (!witness) continue;
    const RunningIntegral<3> force = ForceIntegral(e->fixed, witness->attitude);
    const bool any = fixes || e->IsCopy(stream);
    Judge(e, stream, AccelerationPairs(force, witness->bends), any ? 5.0 : 0.5,
          {"the accelerometer", any, any, kAlike, IsOfAhrs(*e, *witness) ? &*witness : nullptr});
  }
}

}  // namespace trueline
