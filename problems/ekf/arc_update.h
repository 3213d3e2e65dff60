// The update with the first fix after an arc, where linearisation matters most.
#pragma once

#include "problems/ekf/ekf.h"
#include "problems/log/flight_log.h"
#include "problems/vgd/imu_inputs.h"

namespace trueline {

// Predicts `filter` with the IMU from t0 to t1.
void PredictOver(const ImuInputs& imu, TimeNs t0, TimeNs t1, Ekf* filter);

// Predicts from t0 to the fix and updates, iterated: the fix is smoothed back to t0 and the
// prediction repeated, linearised at the smoothed state, until convergence (the iterated linear
// filter-smoother; Jazwinski 1970, section 8.3). False if the gate rejects the fix.
bool IteratedArcUpdate(const ImuInputs& imu, AttitudeForm form, TimeNs t0, const Fix& fix,
                       Ekf* filter);

}  // namespace trueline
