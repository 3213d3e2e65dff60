// A log made ready for a diagnosis, with the options that go with it.
#pragma once

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// The log with the filter's attitude where it has none, and mocap among the fixes (gate -1) where
// the fit is to mocap. Throws InputError where there is no mocap then.
FlightLog PrepareLog(const FlightLog& log, DiagnosisOptions* options);

// Drag is judged by what the flight shows of it, not by what is usual: a prior would make any
// unusual drag look like an effect.
VgdOptions OpenPriors(VgdOptions options);

// What can be tested on a prepared log.
CandidateScope ScopeOf(const FlightLog& log, const DiagnosisOptions& options);

FlightLog WithoutFixes(const FlightLog& log, const std::vector<std::size_t>& fixes);

}  // namespace trueline
