// The logged attitude's turn less that which the gyroscope measures.
#pragma once

#include "problems/diagnosis/mocap_rows.h"

namespace trueline {

// By intervals of 0.1 s, rad, in axes of E'. Offsets: a bias of the gyroscope, and what a filter
// feeds back of the accelerometer's tilt and of its integral (Li et al. 2019, fig. 3).
StreamRows GyroRows(const FlightLog& log);

}  // namespace trueline
