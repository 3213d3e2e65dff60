#include <cmath>

#include "problems/inspection/examination.h"
#include "problems/inspection/force_fit.h"
#include "problems/inspection/position_witness.h"

namespace trueline {
namespace {

constexpr double kLeastCorrelation = 0.8;  // of turn rates with the gyroscope
constexpr double kBaseline = 0.35;         // s, of turns
constexpr double kOfSquare = 0.25;         // of the logarithm, by which the square may be missed

// How many times the turns of a stream are those of the gyroscope; none where they differ.
std::optional<double> GainOfTurns(const Examination& e, const std::string& stream) {
  const RunningIntegral<3> gyro = GyroIntegral(e.fixed);
  const auto turns =
      TurnsOf(AttitudesOf(e.fixed, stream), LogClock(e.fixed), kMostPairs, kBaseline);
  const auto match = MatchVectors(RatePairs(gyro, turns, false), {0.0, 0.02});
  if (!match || match->correlation < kLeastCorrelation) return std::nullopt;
  return match->gain;
}

void StretchClock(double factor, FlightLog* log) {
  const TimeNs begin = log->imu.front().t;
  ForEachStream(*log, [&](const Stream&, auto& samples) {
    for (auto& sample : samples) {
      sample.t = begin + FromSeconds(factor * SecondsBetween(begin, sample.t));
    }
  });
}

}  // namespace

// Turn rates go with the inverse of the unit of time, accelerations with its square.
void CheckTimeScale(Examination* e) {
  if (!ReadsGravity(e->fixed)) return;  // the accelerometer's unit is another
  for (const char* stream : {"fixes", "mocap", "pose"}) {
    const auto witness = PositionWitnessOf(*e, stream);
    if (!witness) continue;
    const auto turns = GainOfTurns(*e, witness->of_attitude);
    if (!turns || std::abs(std::log(*turns)) < kOtherUnit) continue;
    const auto scale = FitPositionScale(BodyForce(e->fixed, witness->attitude), witness->bends);
    const double square = 2.0 * std::log(*turns);
    if (!scale || !(std::abs(std::log(scale->value) - square) < kOfSquare * std::abs(square))) {
      continue;
    }
    Finding finding{"time_scale", "imu", Level::kFatal, *turns, "1", e->log.gravity};
    finding.text = fmt::format(
        "the stamps of the whole log have another unit or rate: the turns of {} are {:.3g} times "
        "those of the gyroscope, and the accelerations of {} {:.3g} times those of the "
        "accelerometer, which is about the square",
        witness->of_attitude, *turns, stream, scale->value);
    finding.remedy = fmt::format(
        "multiply all stamps by {:.4g}: state the unit of the time, or its `scale`, in the map",
        *turns);
    e->Add(finding);
    return StretchClock(*turns, &e->fixed);
  }
}

}  // namespace trueline
