#include "problems/inspection/excerpt.h"

#include <algorithm>
#include <iterator>

namespace trueline {

std::optional<FlightLog> MiddleOfLong(const FlightLog& log) {
  constexpr double kExcerpt = 180.0;  // s
  const bool is_long =
      log.imu.size() > 1 && SecondsBetween(log.imu.front().t, log.imu.back().t) > 2.0 * kExcerpt;
  if (!is_long) return std::nullopt;
  const TimeNs from = log.imu[log.imu.size() / 2].t - FromSeconds(0.5 * kExcerpt);
  const TimeNs to = from + FromSeconds(kExcerpt);
  FlightLog middle;
  middle.gravity = log.gravity;
  middle.environment = log.environment;
  middle.gates = log.gates;
  middle.vehicle = log.vehicle;
  middle.source = log.source;
  const auto copy = [&](const auto& samples, auto* kept) {
    std::copy_if(samples.begin(), samples.end(), std::back_inserter(*kept),
                 [&](const auto& sample) { return sample.t >= from && sample.t <= to; });
  };
  copy(log.imu, &middle.imu);
  copy(log.attitude, &middle.attitude);
  copy(log.fixes, &middle.fixes);
  copy(log.pose, &middle.pose);
  copy(log.mocap, &middle.mocap);
  copy(log.rotors, &middle.rotors);
  copy(log.motors, &middle.motors);
  return middle;
}

}  // namespace trueline
