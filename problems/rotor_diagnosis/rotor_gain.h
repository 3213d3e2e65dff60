// What found causes are worth on flight that took no part in fitting them.
#pragma once

#include "problems/rotor_diagnosis/rotor_search.h"

namespace trueline {

// Mean open-loop position error after half a second, without and with the causes. The flight is cut
// into blocks of a few clusters; those of every second block are predicted with constants and
// causes fitted on the others alone, and the other way round. A cluster (one second of starts)
// counts once in the bootstrap.
Gain MeasureRotorGain(const FlightLog& log, const RotorSearch& search,
                      const std::vector<RotorFound>& found);

}  // namespace trueline
