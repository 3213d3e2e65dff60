// Rows of positions that are no measurement: what a tracker says while it does not see the vehicle.
#pragma once

#include <string>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

struct LostStretch {
  TimeNs from = 0, until = 0;  // of the first and the last row that is no measurement
  bool is_default = false;     // 0 0 0, in place of the last pose
};

struct LostTrack {
  std::string stream;
  std::vector<LostStretch> stretches;

  double Seconds() const;
  std::string Text() const;  // one sentence, with all places
};

// Positions that are exactly 0 0 0 beside others that are far from there, in mocap, pose and fixes;
// poses that keep one value, in mocap and pose, while the gyroscope turns.
std::vector<LostTrack> FindLostTracks(const FlightLog& log);

// Removes these rows from the log, and returns a warning for each stream.
std::vector<std::string> LeaveOutLostTracks(FlightLog* log);

}  // namespace trueline
