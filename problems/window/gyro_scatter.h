// How well a log's gyroscope follows its own AHRS: many logs hold it at a rate at which it misses
// half of the motion, and a data sheet's noise would then be a false promise.
#pragma once

#include "problems/window/imu_inputs.h"

namespace trueline {

// Rotor density of the gyroscope's error for each axis of I (rad/s/sqrt(Hz)): the robust scatter of
// (turn by the AHRS less turn by the gyroscope) over consecutive quarters of a second, less its
// median, which is bias. Includes what the AHRS corrects in that time. Zero for a log without two
// seconds of gapless flight.
Eigen::Vector3d GyroScatter(const ImuInputs& imu);

}  // namespace trueline
