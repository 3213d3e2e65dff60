// The Kalman filter over a whole flight, beside the window estimators.
#pragma once

#include "problems/ekf/ekf.h"
#include "problems/log/flight_log.h"
#include "problems/result/estimate.h"
#include "problems/vgd/drive_track.h"
#include "problems/vgd/flight_data.h"

namespace trueline {

// The update with the first fix after an arc, where linearisation matters most.

// Predicts `filter` with the IMU from t0 to t1.
void PredictOver(const ImuInputs& imu, TimeNs t0, TimeNs t1, Ekf* filter);

// Predicts from t0 to the fix and updates, iterated: the fix is smoothed back to t0 and the
// prediction repeated, linearised at the smoothed state, until convergence (the iterated linear
// filter-smoother; Jazwinski 1970, section 8.3). False if the gate rejects the fix.
bool IteratedArcUpdate(const ImuInputs& imu, AttitudeForm form, TimeNs t0, const Fix& fix,
                       Ekf* filter);

// Runs causally over the log's passes. The estimate at the end of pass tau is "window" tau, whose
// arc is predicted with the IMU alone. Fixes within the arc (withheld, of a flight without gates)
// are used after that, from the arc's start on. The filter has no windows: `gamma` is only stored
// in the result. If an arc has a gap or is too long, position, velocity and attitude are
// initialised again at the next pass; the biases are kept.
EstimatorRun RunEkf(const FlightData& flight, const EkfOptions& options, int gamma);

// The initial state at pass `pass`: a line through its fixes, the AHRS's attitude, zero biases.
NavState StartOfPass(const FlightData& flight, const ImuInputs& imu, const Pass& pass);

}  // namespace trueline
