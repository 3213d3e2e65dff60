// Fixes beside mocap's positions.
#pragma once

#include "problems/inspection/vector_match.h"
#include "problems/log/flight_log.h"

namespace trueline {

// At most 1,500 fixes, each beside mocap's position at the same time less the lag; fixes where
// mocap has a gap are left out. `log` must outlive what is returned.
PairsAt FixPairs(const FlightLog& log);

}  // namespace trueline
