// Parts of a flight.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

// All streams between two stamps, both included.
FlightLog PartOf(const FlightLog& log, TimeNs from, TimeNs to);

// What shows what is fatal: the middle three minutes of a flight longer than six, all streams
// between the same stamps; none of a shorter one.
std::optional<FlightLog> MiddleOfLong(const FlightLog& log);

// Whether two logs hold the same recording.

// Hashes of runs of eight IMU samples, or motor commands where there are none, whatever their
// stamps; sorted, each once.
using Fingerprint = std::vector<std::uint64_t>;
Fingerprint FingerprintOf(const FlightLog& log);

// The share of the shorter log's samples that the other has as well, 0 to 1: noise repeats in
// no other flight.
double SharedRecording(const Fingerprint& a, const Fingerprint& b);

}  // namespace trueline
