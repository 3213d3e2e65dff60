// What faults of the log do to a diagnosis.
#pragma once

#include <vector>

#include "problems/diagnosis/diagnosis.h"
#include "problems/inspection/first_look.h"

namespace trueline {

// States the faults. A flight is not clean with a fault that no effect of the catalogue stands for,
// and nothing is explained where a fault is fatal: constants and causes may be its traces.
void AddLogFaults(const std::vector<LogFault>& faults, Diagnosis* diagnosis);

// Keeps the faults of the first flight, which is diagnosed; its warnings get those of the further
// ones. A further flight with a fatal fault confirms nothing: it is left out, with a warning.
void LeaveOutFaultyFlights(std::vector<FlightLog>* logs, std::vector<LogFault>* faults);

}  // namespace trueline
