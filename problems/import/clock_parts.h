// Where the clock of a recording steps back, as after a restart of the logger.
#pragma once

#include <cstddef>
#include <vector>

#include "problems/common/time.h"

namespace trueline {

// Rows whose time goes on without a jump.
struct ClockRun {
  TimeNs from = 0, to = 0;
  std::size_t count = 0;
};

// Rows in the order of the file between two steps back.
struct ClockPart {
  std::size_t begin = 0, end = 0;   // places in the file (ForeignRow::Place())
  std::size_t count = 0;            // rows
  TimeNs from = 0, to = 0;          // the middle of its first and of its last rows
  std::vector<ClockRun> runs = {};  // of several rows; a part may lack times that another has
};

// `stamps` in the order of the file, and their places there. A part for each time between steps.
std::vector<ClockPart> PartsByClock(const std::vector<TimeNs>& stamps,
                                    const std::vector<std::size_t>& places);
// Whether parts have the same times, by more than rows out of order explain.
bool AnyOverlap(const std::vector<ClockPart>& parts);

}  // namespace trueline
