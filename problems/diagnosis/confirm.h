// Whether what was found on one flight repeats on another of the same vehicle.
#pragma once

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// How a cause came out on another flight, where it was fitted at `value` and tested alone. The name
// of the log is left to the caller.
Repeat RepeatOf(const Cause& cause, const Eigen::VectorXd& value, const ScoreTest& test);

// Adds to each cause of the flight `first` how it comes out on `log` (both as recorded): all causes
// are fitted there together, and each is tested alone, once. It repeats where it stands out with p
// < 0.05, by the same sign and by 0.5 to 2 times the size, or by a size that differs no more than
// the sigmas let it.
void AddRepeats(const FlightLog& first, const FlightLog& log, const DiagnosisOptions& options,
                std::vector<Cause>* causes);

// Confirmed is what repeats on more than half of the further flights.
void Confirm(std::vector<Cause>* causes);

}  // namespace trueline
