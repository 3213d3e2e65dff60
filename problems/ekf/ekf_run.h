// The Kalman filter over a whole flight, beside the window estimators.
#pragma once

#include "problems/ekf/ekf.h"
#include "problems/result/estimate.h"
#include "problems/window/flight_data.h"
#include "problems/window/imu_inputs.h"

namespace trueline {

// Runs causally over the log's passes; what stands at the end of pass tau is "window" tau, whose
// arc is predicted with the IMU alone. The filter has no windows: `gamma` is only noted in the
// result. Where an arc has a gap or is too long, position, velocity and attitude start anew at the
// next pass, and the biases are kept.
EstimatorRun RunEkf(const FlightData& flight, const EkfOptions& options, int gamma);

// The state where pass `pass` begins: a line through its fixes, the AHRS's attitude, no biases.
NavState StartOfPass(const FlightData& flight, const ImuInputs& imu, const Pass& pass);

}  // namespace trueline
