// Scatter of a log's gyroscope against its own AHRS. Many logs sample it at a rate that misses half
// of the motion; a data sheet's noise is then too small.
#pragma once

#include "problems/vgd/imu_inputs.h"

namespace trueline {

// Root density of the gyroscope's error for each axis of I (rad/s/sqrt(Hz)): the robust scatter of
// (rotation by the AHRS less rotation by the gyroscope) over consecutive quarters of a second, less
// its median, which is bias. Includes the AHRS's corrections in that time. Zero for a log without
// two seconds of gapless flight.
Eigen::Vector3d GyroScatter(const ImuInputs& imu);

}  // namespace trueline
