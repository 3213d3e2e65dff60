// The gain of found causes on held-out flight.
#pragma once

#include "problems/rotor_diagnosis/rotor_search.h"

namespace trueline {

// Mean open-loop position error after half a second, without and with the causes. The flight is cut
// into blocks of a few clusters. Two folds: every second block is predicted with constants and
// causes fitted to the others, then the roles are swapped. The bootstrap resamples clusters (one
// second of starts each).
Gain MeasureRotorGain(const FlightLog& log, const RotorSearch& search,
                      const std::vector<RotorFound>& found);

}  // namespace trueline
