// Whether causes of one flight repeat on another flight of the same vehicle.
#pragma once

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// The result of a cause fitted at `value` on another flight and tested singly. The caller fills in
// the log's name.
Repeat RepeatOf(const Cause& cause, const Eigen::VectorXd& value, const ScoreTest& test);

// Adds to each cause of the flight `first` its estimate on `log` (both as recorded). All causes are
// fitted to `log` together; each is tested singly. A cause repeats if it is significant (p < 0.05),
// has the same sign, and its size is 0.5 to 2 times the first one or within the sigmas of it.
void AddRepeats(const FlightLog& first, const FlightLog& log, const DiagnosisOptions& options,
                std::vector<Cause>* causes);

// A cause is confirmed if it repeats on more than half of the further flights.
void Confirm(std::vector<Cause>* causes);

}  // namespace trueline
