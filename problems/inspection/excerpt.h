// A part of a long flight that shows what is fatal.
#pragma once

#include <optional>

#include "problems/log/flight_log.h"

namespace trueline {

// The middle three minutes of a flight longer than six, all streams between the same stamps; none
// of a shorter one.
std::optional<FlightLog> MiddleOfLong(const FlightLog& log);

}  // namespace trueline
