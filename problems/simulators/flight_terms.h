// Forces and moments of a flight, term by term, by sums alone: also those that the fitted model
// lacks. Two logs that are compared show what one of their worlds has and the other has not.
#pragma once

#include <map>
#include <string>

#include "problems/log/flight_log.h"
#include "problems/simulators/flight_estimate.h"

namespace trueline {

// By name of NeutralInfo. Sigmas come from fits that leave out a sixteenth of the flight each.
// Empty for a log without measured rotor speeds.
std::map<std::string, FlightValue> TermsOf(const FlightLog& log, const FlightEstimate& estimate);

}  // namespace trueline
