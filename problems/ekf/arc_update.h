// The first fix after a blind arc, where linearisation matters most.
#pragma once

#include "problems/ekf/ekf.h"
#include "problems/log/flight_log.h"
#include "problems/window/imu_inputs.h"

namespace trueline {

// Predicts `filter` with the IMU from t0 to t1.
void PredictOver(const ImuInputs& imu, TimeNs t0, TimeNs t1, Ekf* filter);

// Predicts from t0 to the fix and corrects, iterated: the fix is smoothed back to t0, prediction is
// repeated with its linearisation around the smoothed state, until that settles (the iterated
// linear filter-smoother; Jazwinski 1970, section 8.3). False where the gate refuses the fix.
bool IteratedArcUpdate(const ImuInputs& imu, AttitudeForm form, TimeNs t0, const Fix& fix,
                       Ekf* filter);

}  // namespace trueline
