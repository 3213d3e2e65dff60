// The Kalman filter over a whole flight, beside the window estimators.
#pragma once

#include "problems/ekf/ekf.h"
#include "problems/result/estimate.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/imu_inputs.h"

namespace trueline {

// Runs causally over the log's passes. The estimate at the end of pass tau is "window" tau, whose
// arc is predicted with the IMU alone. Fixes within the arc (withheld, of a flight without gates)
// are used after that, from the arc's start on. The filter has no windows: `gamma` is only stored
// in the result. If an arc has a gap or is too long, position, velocity and attitude are
// initialised again at the next pass; the biases are kept.
EstimatorRun RunEkf(const FlightData& flight, const EkfOptions& options, int gamma);

// The initial state at pass `pass`: a line through its fixes, the AHRS's attitude, zero biases.
NavState StartOfPass(const FlightData& flight, const ImuInputs& imu, const Pass& pass);

}  // namespace trueline
