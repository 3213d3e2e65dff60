// Parts of a flight.
#pragma once

#include <optional>

#include "problems/log/flight_log.h"

namespace trueline {

// All streams between two stamps, both included.
FlightLog PartOf(const FlightLog& log, TimeNs from, TimeNs to);

// What shows what is fatal: the middle three minutes of a flight longer than six, all streams
// between the same stamps; none of a shorter one.
std::optional<FlightLog> MiddleOfLong(const FlightLog& log);

}  // namespace trueline
