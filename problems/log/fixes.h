// What the fixes of a log state.
#pragma once

#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

double MedianSigma(const std::vector<Fix>& fixes);  // m; NaN for no fixes

}  // namespace trueline
