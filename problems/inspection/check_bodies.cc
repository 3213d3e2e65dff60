#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "problems/common/units.h"
#include "problems/inspection/examination.h"

namespace trueline {
namespace {

constexpr double kSameTurn = 8.0 * kDegree;  // of two witnesses
constexpr double kLeastBodyTurn = 8.0 * kDegree;
constexpr double kLeastGyroScale = 0.04;
constexpr double kLeastAlikeRates = 0.95;  // correlation that shows a scale which is no unit's
constexpr double kLongBaseline = 0.35;     // s
constexpr double kClearCorrelation = 0.3;
constexpr double kClearLean = 12.0 * kDegree;  // by which one reading must be more upright

// Lean of the mean specific force if the accelerometer were turned.
double MeanLean(const FlightLog& log, const Eigen::Matrix3d& turn) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : log.imu) sum += sample.accel;
  return LeanOf(turn * sum);
}

bool SameTurn(const RateWitness& a, const RateWitness& b) {
  if ((a.turn.determinant() > 0.0) != (b.turn.determinant() > 0.0)) return false;
  const double sigma = std::sqrt(a.match.turn_cov.trace() + b.match.turn_cov.trace());
  return TurnBetween(a.turn, b.turn).norm() < std::max(kSameTurn, 3.0 * sigma);
}

// Whether the gyroscope is turned rather than the witnesses that say so.
struct Blame {
  bool gyro = false;
  std::string why;
};

Blame WhoIsTurned(const Examination& e, const std::vector<const RateWitness*>& turned,
                  std::size_t independent) {
  if (turned.size() < independent) {
    return {false, "another attitude agrees with the gyroscope"};
  }
  const RateWitness& first = *turned.front();
  if (first.turn.determinant() < 0.0) {
    return {true, "a rotation can't be mirrored, so that the gyroscope is"};
  }
  for (const RateWitness* other : turned) {
    if (!SameTurn(first, *other)) return {false, "the attitudes differ from each other as well"};
  }
  if (turned.size() > 1) return {true, "two attitudes agree against it"};
  const double before = MeanLean(e.fixed, Eigen::Matrix3d::Identity());
  const double after = MeanLean(e.fixed, first.turn);
  if (after < before - kClearLean) {
    return {true, fmt::format("the mean specific force leans by {:.0f} deg as read and by {:.0f} "
                              "deg after the turn",
                              before / kDegree, after / kDegree)};
  }
  if (before < after - kClearLean) {
    return {false, fmt::format("the mean specific force leans by {:.0f} deg as read, as it should, "
                               "and by {:.0f} deg if the IMU were turned",
                               before / kDegree, after / kDegree)};
  }
  return {first.stream == "attitude",
          first.stream == "attitude"
              ? "the log alone does not show which of the two; an autopilot's attitude is that of "
                "the vehicle"
              : "the log alone does not show which of the two; a pose's body axes are a matter of "
                "its set-up"};
}

// Whether the accelerometer, turned along with the gyroscope, reads gravity as upright as before.
bool StaysUpright(const Examination& e, const Eigen::Matrix3d& turn) {
  return MeanLean(e.fixed, turn) < MeanLean(e.fixed, Eigen::Matrix3d::Identity()) + kClearLean;
}

// A turn that moves gravity away from the body's -z, where its mirror image does not, is replaced
// by that. Flights without turns about one axis do not show the handedness otherwise. Where both
// move it the gyroscope alone is turned, and its own rates decide.
void KeepUpright(const Examination& e, double least, RateWitness* witness) {
  if (!witness->match.mirrored || IsIdentity(witness->turn)) return;
  if (StaysUpright(e, witness->turn)) return;
  VectorMatch other = witness->match;
  other.turn = *witness->match.mirrored;
  const Eigen::Matrix3d plain = PlainTurn(other, least);
  if (StaysUpright(e, plain) || witness->match.reflection < 0.0) witness->turn = plain;
}

// A witness that agrees with the gyroscope only because it shows too little.
bool ShowsTooLittle(const RateWitness& witness) {
  return IsIdentity(witness.turn) &&
         witness.match.unturned < witness.match.correlation - kClearCorrelation;
}

Finding TurnFinding(const Examination& e, const RateWitness& witness, const std::string& id,
                    const std::string& stream, const Eigen::Matrix3d& repair) {
  const double size = TurnSize(repair);
  return {.id = id,
          .stream = stream,
          .level = size > 15.0 ? Level::kFatal : Level::kBiases,
          .size = size,
          .unit = "deg",
          .error = 2.0 * e.log.gravity * std::sin(0.5 * size * kDegree),
          .sigma = std::sqrt(witness.match.turn_cov.trace()) / kDegree,
          .repaired = true};
}

void TurnGyro(Examination* e, const RateWitness& witness, const std::string& why) {
  const Eigen::Matrix3d repair = witness.turn;
  Finding finding = TurnFinding(*e, witness, "imu_axes", "imu", repair);
  finding.text = fmt::format(
      "the gyroscope's axes are not the body's: its readings as {} agree with the turn rates of {} "
      "to a correlation of {:.3f}, as read to {:.3f}; {}",
      AxesText(repair), witness.stream, witness.match.correlation, witness.match.unturned, why);
  finding.remedy =
      "take the axes so; the accelerometer is judged by itself where position shows it";
  StreamRepair change{.gyro = repair};
  // Of the same chip, unless gravity contradicts; CheckAccelerometer() looks whether that is so.
  if (StaysUpright(*e, repair)) change.accel = repair;
  e->Repair("imu", change);
  e->Add(finding);
}

void TurnAttitude(Examination* e, const RateWitness& witness, const std::string& why) {
  if (witness.turn.determinant() < 0.0) return;
  const Eigen::Matrix3d repair = witness.turn.transpose();
  Finding finding = TurnFinding(*e, witness, "body_axes", witness.stream, repair);
  finding.text = fmt::format(
      "the attitude of {}.csv is that of other body axes: its turn rates as {} agree with the "
      "gyroscope to a correlation of {:.3f}, as read to {:.3f}; {}",
      witness.stream, AxesText(repair), witness.match.correlation, witness.match.unturned, why);
  finding.remedy = "state the body axes of that stream so";
  e->Repair(witness.stream, {.body = repair});
  e->Add(finding);
}

// Whether the ratio of sizes is off by more than noise in either stream explains.
bool IsOff(const VectorMatch& match) {
  const double least =
      std::abs(std::log(match.gain)) + std::log(match.correlation) - 5.0 * match.gain_sigma;
  return least > 0.0 && std::abs(match.gain - 1.0) > kLeastGyroScale;
}

// The unit that the gyroscope's readings are in. Noise of the attitude's rates makes the ratio of
// sizes larger than the factor, that of the gyroscope smaller, by the correlation at most.
const KnownUnit* UnitOfRates(const VectorMatch& match) {
  return UnitNear("rad/s", match.gain,
                  3.0 * match.gain_sigma / match.gain - std::log(match.correlation));
}

std::optional<VectorMatch> MatchOverLongTime(const Examination& e, const std::string& stream) {
  const RunningIntegral<3> gyro = GyroIntegral(e.fixed);
  const auto turns = TurnsOf(AttitudesOf(e.fixed, stream), LogClock(e.fixed), 1500, kLongBaseline);
  return MatchVectors(RatePairs(gyro, turns, false), {0.0, 0.02});
}

// The gyroscope's scale: the ratio of rates by every attitude, where it is outside of what noise in
// either explains.
void CheckGain(Examination* e) {
  const RateWitness* best = nullptr;
  for (const RateWitness& witness : e->rates) {
    if (e->IsCopy(witness.stream)) continue;
    if (best == nullptr || witness.match.correlation > best->match.correlation) best = &witness;
  }
  if (best == nullptr || !IsOff(best->match)) return;
  const double gain = best->match.gain;
  const KnownUnit* unit = UnitOfRates(best->match);
  if (unit == nullptr && best->match.correlation < kLeastAlikeRates) return;
  // A filter of either side changes fast turns; a scale changes slow ones as well.
  const auto slow = MatchOverLongTime(*e, best->stream);
  if (!slow || !IsOff(*slow) || std::abs(slow->gain - gain) > 0.3 * std::abs(gain - 1.0)) return;
  const double error = e->log.gravity * std::min(1.0, best->match.seen_rms * std::abs(gain - 1.0));
  const double sigma = best->match.gain_sigma / (gain * gain);
  Finding finding{"gyro_scale", "imu", Level::kBiases, 1.0 / gain, "1", error, sigma};
  finding.text = fmt::format("the gyroscope reads {:.3f} +- {:.3f} of the turn rates that {} shows",
                             finding.size, finding.sigma, best->stream);
  const double factor = unit != nullptr ? unit->factor : gain;
  if (unit != nullptr) finding.level = Level::kFatal;
  finding.remedy = fmt::format("multiply its readings by {:.6g}{}; check the unit and range",
                               factor, UnitText(unit));
  finding.repaired = true;
  e->Repair("imu", {.gyro_scale = factor});
  e->Add(finding);
}

}  // namespace

void CheckBodies(Examination* e) {
  std::vector<const RateWitness*> turned;
  std::size_t independent = 0;
  for (RateWitness& witness : e->rates) {
    KeepUpright(*e, kLeastBodyTurn, &witness);
    if (e->IsCopy(witness.stream) || ShowsTooLittle(witness)) continue;
    ++independent;
    if (!IsIdentity(witness.turn)) turned.push_back(&witness);
  }
  if (!turned.empty()) {
    const Blame blame = WhoIsTurned(*e, turned, independent);
    if (blame.gyro) {
      TurnGyro(e, *turned.front(), blame.why);
    } else {
      for (const RateWitness* witness : turned) TurnAttitude(e, *witness, blame.why);
      for (const RateWitness& witness : e->rates) {
        if (e->IsCopy(witness.stream) && !IsIdentity(witness.turn)) {
          TurnAttitude(e, witness, "it repeats attitude.csv");
        }
      }
    }
  }
  CheckGain(e);
}

}  // namespace trueline
