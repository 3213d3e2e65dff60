// Rows of positions that are no measurement: what a tracker says while it does not see the vehicle.
#pragma once

#include <string>
#include <vector>

#include "problems/inspection/repair.h"
#include "problems/log/flight_log.h"

namespace trueline {

enum class Lost {
  kZero,     // exactly 0 0 0, beside others that are far from there
  kHeld,     // a pose or position that keeps one value while the vehicle moves
  kFlipped,  // a pose of other body axes, which a tracker takes from another set of markers
};

struct LostTrack {
  std::string stream;
  Lost how = Lost::kZero;
  std::vector<Stretch> stretches;

  double Seconds() const;
  std::string Text() const;  // one sentence, with all places
};

// In mocap, pose and fixes, by stream and kind.
std::vector<LostTrack> FindLostTracks(const FlightLog& log);

// Removes these rows from the log, and returns a warning for each stream and kind.
std::vector<std::string> LeaveOutLostTracks(FlightLog* log);

}  // namespace trueline
