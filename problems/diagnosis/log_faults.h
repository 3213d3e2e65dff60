// What faults of the log do to a diagnosis.
#pragma once

#include <string>
#include <vector>

#include "problems/diagnosis/diagnosis.h"
#include "problems/inspection/first_look.h"

namespace trueline {

// The verdict of a flight with these faults. It is not clean with one that no effect of the
// catalogue stands for, and nothing is explained where one is fatal: constants and causes may be
// its traces.
std::string VerdictWith(const std::vector<LogFault>& faults, const std::string& verdict);

// States the faults in the diagnosis and its verdict; with a fatal one the model has no effects.
void AddLogFaults(const std::vector<LogFault>& faults, Diagnosis* diagnosis);

// Keeps the faults of the first flight, which is diagnosed; its warnings get those of the further
// ones. A further flight with a fatal fault is left out, with a warning.
void LeaveOutFaultyFlights(std::vector<FlightLog>* logs, std::vector<LogFault>* faults);

}  // namespace trueline
