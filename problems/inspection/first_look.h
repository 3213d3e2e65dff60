// What an inspection finds before a calibration or diagnosis, as warnings.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

// ReadNativeLog, whose warnings also hold FirstLook's findings.
FlightLog ReadAndLook(const std::filesystem::path& directory);

// What Inspect() finds to be fatal, clocks that differ by 0.1 s or more, streams that cover too
// little of the IMU's time and a missing attitude, each with its remedy. Of a flight longer than
// six minutes it inspects the middle three, so that it stays cheap beside a calibration.
std::vector<std::string> FirstLook(const FlightLog& log);

}  // namespace trueline
