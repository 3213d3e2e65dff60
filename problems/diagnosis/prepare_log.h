// Prepares a log, and the options, for a diagnosis.
#pragma once

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// The log with the filter's attitude if it has none, and mocap among the fixes (gate -1) if the fit
// is to mocap. Throws InputError if mocap is then missing.
FlightLog PrepareLog(const FlightLog& log, DiagnosisOptions* options);

// Widens drag's prior: under a tight one any unusual linear drag would look like an effect.
VgdOptions OpenPriors(VgdOptions options);

// What can be tested on a prepared log.
CandidateScope ScopeOf(const FlightLog& log, const DiagnosisOptions& options);

FlightLog WithoutFixes(const FlightLog& log, const std::vector<std::size_t>& fixes);

}  // namespace trueline
