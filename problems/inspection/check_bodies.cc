#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/force_fit.h"
#include "problems/inspection/heading.h"
#include "problems/inspection/position_witness.h"

namespace trueline {
namespace {

// Lean of the mean specific force if the accelerometer were turned.
double MeanLean(const FlightLog& log, const Eigen::Matrix3d& turn) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : log.imu) sum += sample.accel;
  return LeanOf(turn * sum);
}

bool SameTurn(const RateWitness& a, const RateWitness& b) {
  if ((a.turn.determinant() > 0.0) != (b.turn.determinant() > 0.0)) return false;
  const double sigma = std::sqrt(a.match.turn_cov.trace() + b.match.turn_cov.trace());
  return TurnBetween(a.turn, b.turn).norm() < std::max(kOtherAxes, kLikely * sigma);
}

// Whether north of the positions is turned from that of the attitude as its body is: then the
// attitude is in other axes of both, as angles are of which two have the other sign.
bool IsTurnedInEarthToo(const Examination& e, const RateWitness& witness) {
  if (witness.stream != "attitude" || !IsHeading(witness.turn)) return false;
  for (const char* stream : {"mocap", "fixes"}) {
    const auto heading = HeadingOf(e.fixed, stream, kOrdinaryGain);
    if (!heading) continue;
    const double apart = std::remainder(heading->angle + HeadingIn(witness.turn), 2.0 * M_PI);
    return heading->none_excluded > kLikely && std::abs(apart) < std::abs(heading->angle);
  }
  return false;
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
  if (after < before - kOtherAxes) {
    return {true, fmt::format("the mean specific force leans by {:.0f} deg as read and by {:.0f} "
                              "deg after the turn",
                              before / kDegree, after / kDegree)};
  }
  if (before < after - kOtherAxes) {
    return {false, fmt::format("the mean specific force leans by {:.0f} deg as read, as it should, "
                               "and by {:.0f} deg if the IMU were turned",
                               before / kDegree, after / kDegree)};
  }
  if (IsTurnedInEarthToo(e, first)) {
    return {false, "north of the positions is turned from its own by as much"};
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
  return MeanLean(e.fixed, turn) < MeanLean(e.fixed, Eigen::Matrix3d::Identity()) + kOtherAxes;
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
  return IsIdentity(witness.turn) && witness.match.unturned < witness.match.correlation - kLittle;
}

Finding TurnFinding(const Examination& e, const RateWitness& witness, const FaultKind& kind,
                    const std::string& stream, const Eigen::Matrix3d& repair) {
  const double size = TurnSize(repair);
  return {.kind = &kind,
          .stream = stream,
          .level = LevelOfTurn(size),
          .size = size,
          .error = ErrorOfTurn(e, size * kDegree),
          .sigma = std::sqrt(witness.match.turn_cov.trace()) / kDegree};
}

void TurnGyro(Examination* e, const RateWitness& witness, const std::string& why) {
  const Eigen::Matrix3d repair = witness.turn;
  StreamRepair change{.gyro = repair};
  // Of the same chip, unless gravity contradicts; CheckAccelerometer() looks whether that is so.
  if (StaysUpright(*e, repair)) change.accel = repair;
  e->AddRepaired(
      TurnFinding(*e, witness, fault::kImuAxes, "imu", repair),
      fmt::format("the gyroscope's axes are not the body's: its readings as {} agree with the turn "
                  "rates of {} to a correlation of {:.3f}, as read to {:.3f}; {}",
                  AxesText(repair), witness.stream, witness.match.correlation,
                  witness.match.unturned, why),
      "take the axes so; the accelerometer is judged by itself where position shows it", change);
}

void TurnAttitude(Examination* e, const RateWitness& witness, const std::string& why) {
  if (witness.turn.determinant() < 0.0) return;
  const Eigen::Matrix3d repair = witness.turn.transpose();
  e->AddRepaired(
      TurnFinding(*e, witness, fault::kBodyAxes, witness.stream, repair),
      fmt::format("the attitude of {}.csv is that of other body axes: its turn rates as {} agree "
                  "with the gyroscope to a correlation of {:.3f}, as read to {:.3f}; {}",
                  witness.stream, AxesText(repair), witness.match.correlation,
                  witness.match.unturned, why),
      "state the body axes of that stream so", {.body = repair});
}

// The unit that the gyroscope's readings are in. Noise of the attitude's rates makes the ratio of
// sizes larger than the factor, that of the gyroscope smaller, by the correlation at most.
const KnownUnit* UnitOfRates(const VectorMatch& match) {
  return UnitNear("rad/s", match.gain,
                  3.0 * match.gain_sigma / match.gain - std::log(match.correlation));
}

// Whether the ratio of rates is off in a way that neither noise nor a filter explains: a filter
// changes fast turns, a scale changes slow ones as well.
bool IsScaled(const Examination& e, const RateWitness& witness) {
  const VectorMatch& match = witness.match;
  if (!HasOtherScale(match)) return false;
  if (UnitOfRates(match) == nullptr && match.correlation < kGood) return false;
  const auto slow = MatchLongTurns(e, witness.stream);
  return slow && HasSameScale(*slow, match);
}

std::vector<AttitudeSample> WithTiltScaled(std::vector<AttitudeSample> attitude, double factor) {
  for (AttitudeSample& sample : attitude) {
    const Eigen::Vector3d down = sample.q_Ep_I * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ().cross(down);
    const double tilt = std::atan2(axis.norm(), down.z());
    if (axis.norm() < 1e-9) continue;
    sample.q_Ep_I = Eigen::AngleAxisd((factor - 1.0) * tilt, axis.normalized()) * sample.q_Ep_I;
  }
  return attitude;
}

// By how much the residual between positions and accelerometer falls if the tilts of the attitude
// are divided by `gain`; none where no position comes with this attitude.
std::optional<double> RestAfterTilt(const Examination& e, const std::string& stream, double gain) {
  for (const char* of : {"mocap", "pose", "fixes"}) {
    const auto witness = PositionWitnessOf(e, of);
    if (!witness || (witness->of_attitude != stream && !e.IsCopy(witness->of_attitude))) continue;
    const auto bends = InEarthOfAttitude(e, *witness);
    if (!bends) continue;
    const auto residual = [&](const std::vector<AttitudeSample>& attitude) {
      return ForceResidual(BodyForce(e.fixed, attitude), *bends, Eigen::Matrix3d::Identity());
    };
    const double as_read = residual(witness->attitude);
    const double scaled = residual(WithTiltScaled(witness->attitude, 1.0 / gain));
    if (std::isfinite(as_read) && as_read > 0.0) return scaled / as_read;
  }
  return std::nullopt;
}

// m/s^2, by which a specific force points elsewhere where the turns between are so much too large.
double HarmOfScale(const Examination& e, const VectorMatch& match) {
  return e.log.gravity * std::min(1.0, match.seen_rms * std::abs(match.gain - 1.0));
}

void AddGyroScale(Examination* e, const RateWitness& by) {
  const double gain = by.match.gain, reads = 1.0 / gain;
  const double sigma = by.match.gain_sigma / (gain * gain);
  AddScale(e, &StreamRepair::gyro_scale, gain, UnitOfRates(by.match),
           {&fault::kGyroScale, "imu", Level::kBiases, reads, HarmOfScale(*e, by.match), sigma},
           fmt::format("the gyroscope reads {:.3f} +- {:.3f} of the turn rates that {} shows",
                       reads, sigma, by.stream));
}

void AddAttitudeScale(Examination* e, const RateWitness& of, const std::string& why) {
  const Finding finding{
      &fault::kAttitudeScale,    of.stream,          Level::kBiases, of.match.gain,
      HarmOfScale(*e, of.match), of.match.gain_sigma};
  e->Add(finding,
         fmt::format("the turns of {}.csv are {:.3f} +- {:.3f} times those of the gyroscope, {}",
                     of.stream, finding.size, finding.sigma, why),
         "check the unit of its angles, and the filter that estimates it");
}

// A ratio between the gyroscope's rates and those of an attitude is the fault of the one that a
// third stream contradicts: another attitude, or positions beside the accelerometer.
void JudgeLoneScale(Examination* e, const RateWitness& witness) {
  if (UnitOfRates(witness.match) != nullptr) return AddGyroScale(e, witness);
  const auto rest = RestAfterTilt(*e, witness.stream, witness.match.gain);
  if (rest && *rest < kExplains) {
    AddAttitudeScale(e, witness,
                     "and so are its tilts: positions and the accelerometer agree better without");
  } else if (rest && *rest > 1.0 / kExplains) {
    AddGyroScale(e, witness);
  } else {
    e->result.notes.push_back(
        fmt::format("which of the gyroscope and {}.csv is off: the turns of {}.csv are {:.3f} +- "
                    "{:.3f} times those of "
                    "the gyroscope",
                    witness.stream, witness.stream, witness.match.gain, witness.match.gain_sigma));
  }
}

// Whether the rates agree well enough to tell that the gyroscope reads them right.
bool IsSound(const VectorMatch& match) {
  return !HasOtherScale(match) && match.correlation > kSound && match.gain_sigma < kOtherScale;
}

void CheckGain(Examination* e) {
  std::vector<const RateWitness*> scaled, sound;
  for (const RateWitness& witness : e->rates) {
    if (e->IsCopy(witness.stream)) continue;
    if (IsScaled(*e, witness))
      scaled.push_back(&witness);
    else if (IsSound(witness.match))
      sound.push_back(&witness);
  }
  if (scaled.empty()) return;
  if (!sound.empty()) {
    for (const RateWitness* witness : scaled) {
      AddAttitudeScale(e, *witness, fmt::format("with which {}.csv agrees", sound.front()->stream));
    }
  } else if (scaled.size() == 1) {
    JudgeLoneScale(e, *scaled.front());
  } else {
    AddGyroScale(e,
                 **std::max_element(scaled.begin(), scaled.end(), [](const auto* a, const auto* b) {
                   return a->match.correlation < b->match.correlation;
                 }));
  }
}

}  // namespace

std::optional<VectorMatch> MatchLongTurns(const Examination& e, const std::string& stream) {
  constexpr double kLong = 0.35;  // s
  const RunningIntegral<3> gyro = GyroIntegral(e.fixed);
  const auto turns = TurnsOf(AttitudesOf(e.fixed, stream), LogClock(e.fixed), kMostPairs, kLong);
  return MatchVectors(RatePairs(gyro, turns, false), {0.0});
}

void CheckBodies(Examination* e) {
  std::vector<const RateWitness*> turned;
  std::size_t independent = 0;
  for (RateWitness& witness : e->rates) {
    KeepUpright(*e, kOtherAxes, &witness);
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
