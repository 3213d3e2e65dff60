// The motors of a flight that logs both their commands and their speeds.
#pragma once

#include <optional>

#include "problems/log/flight_log.h"

namespace trueline {

// Speeds follow slope u + offset with a lag of first order.
struct MotorResponse {
  double lag, lag_sigma;                // s
  double full_speed, full_speed_sigma;  // rad/s, at u = 1
};
// None where the log lacks either, where commands explain little of the speeds, or
// where parts of the flight show different lags.
std::optional<MotorResponse> FindMotorResponse(const FlightLog& log);

}  // namespace trueline
