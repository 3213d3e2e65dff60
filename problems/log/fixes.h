// What the fixes of a log state, and the gates that they are of.
#pragma once

#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

double MedianSigma(const std::vector<Fix>& fixes);  // m; NaN for no fixes
// The gate of an id; null if the log has none.
const Gate* GateOf(const FlightLog& log, int id);

}  // namespace trueline
