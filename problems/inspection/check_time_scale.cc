#include <cmath>

#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/force_fit.h"
#include "problems/inspection/position_witness.h"

namespace trueline {
namespace {

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
    const auto turns = MatchLongTurns(*e, witness->of_attitude);
    if (!turns || turns->correlation < kSound) continue;
    const double gain = turns->gain;
    if (std::abs(std::log(gain)) < kOtherUnit) continue;
    const auto scale = FitPositionScale(BodyForce(e->fixed, witness->attitude), witness->bends);
    const double square = 2.0 * std::log(gain);
    if (!scale || !(std::abs(std::log(scale->value) - square) < kOtherUnit * std::abs(square))) {
      continue;
    }
    Finding finding{"time_scale", "imu", Level::kFatal, gain, "1", e->log.gravity};
    finding.text = fmt::format(
        "the stamps of the whole log have another unit or rate: the turns of {} are {:.3g} times "
        "those of the gyroscope, and the accelerations of {} {:.3g} times those of the "
        "accelerometer, which is about the square",
        witness->of_attitude, gain, stream, scale->value);
    finding.remedy = fmt::format(
        "multiply all stamps by {:.4g}: state the unit of the time, or its `scale`, in the map",
        gain);
    e->Add(finding);
    return StretchClock(gain, &e->fixed);
  }
}

}  // namespace trueline
