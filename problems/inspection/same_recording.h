// Whether two logs hold the same recording.
#pragma once

#include "problems/log/flight_log.h"

namespace trueline {

// The share of the shorter log's IMU samples that the other has as well, whatever their stamps, 0
// to 1: noise repeats in no other flight. Runs of eight equal samples count.
double SharedRecording(const FlightLog& a, const FlightLog& b);

}  // namespace trueline
