// The streams of a log as a table for people.
#pragma once

#include <string>

#include "problems/log/flight_log.h"

namespace trueline {

// One line for each stream that is there: samples, mean rate (Hz), first and last stamp (s), and
// the channel of the foreign log, where one is known.
std::string StreamTable(const FlightLog& log);

}  // namespace trueline
