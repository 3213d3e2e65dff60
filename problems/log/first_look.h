// What the streams of a log say about each other before anything is fitted: whether they cover the
// same time, and whether their clocks agree.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

// How late a stream is against the gyroscope, by the correlation of turn rates.
struct ClockOffset {
  double seconds;                 // positive: the stream's stamps are too large
  double correlation;             // at that offset; 1 for the same course
  double as_stamped;              // correlation at no offset
  std::optional<double> or_else;  // s, farther off and as good: laps repeat
};

// Turn rates (norm, rad/s) of the gyroscope against those of an attitude. Offsets up to 5 s are
// tried. A correlation of NaN: the streams share too little time, or nothing turns.
ClockOffset OffsetAgainstGyro(const std::vector<ImuSample>& imu,
                              const std::vector<AttitudeSample>& attitude);

// ReadNativeLog, whose warnings also hold FirstLook's findings.
FlightLog ReadAndLook(const std::filesystem::path& directory);

// One sentence with a remedy for each stream that covers too little of the IMU's time, for a
// missing attitude, and for clocks that disagree.
std::vector<std::string> FirstLook(const FlightLog& log);

}  // namespace trueline
