#include "problems/inspection/excerpt.h"

#include <algorithm>
#include <iterator>

namespace trueline {

FlightLog PartOf(const FlightLog& log, TimeNs from, TimeNs to) {
  FlightLog part;
  part.gravity = log.gravity;
  part.environment = log.environment;
  part.gates = log.gates;
  part.vehicle = log.vehicle;
  part.source = log.source;
  const auto copy = [&](const auto& samples, auto* kept) {
    std::copy_if(samples.begin(), samples.end(), std::back_inserter(*kept),
                 [&](const auto& sample) { return sample.t >= from && sample.t <= to; });
  };
  copy(log.imu, &part.imu);
  copy(log.attitude, &part.attitude);
  copy(log.fixes, &part.fixes);
  copy(log.pose, &part.pose);
  copy(log.mocap, &part.mocap);
  copy(log.rotors, &part.rotors);
  copy(log.motors, &part.motors);
  return part;
}

std::optional<FlightLog> MiddleOfLong(const FlightLog& log) {
  constexpr double kExcerpt = 180.0;  // s
  const bool is_long =
      log.imu.size() > 1 && SecondsBetween(log.imu.front().t, log.imu.back().t) > 2.0 * kExcerpt;
  if (!is_long) return std::nullopt;
  const TimeNs from = log.imu[log.imu.size() / 2].t - FromSeconds(0.5 * kExcerpt);
  return PartOf(log, from, from + FromSeconds(kExcerpt));
}

}  // namespace trueline
