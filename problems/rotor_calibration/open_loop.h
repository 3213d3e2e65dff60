// Open-loop prediction on flight that took no part in a fit: from the filter's state at a time, the
// rotor speeds alone say where the vehicle is a while later.
#pragma once

#include <vector>

#include "problems/rotor_ekf/rotor_ekf.h"

namespace trueline {

struct OpenLoopError {
  double t;        // s, of the start
  double horizon;  // s
  double error;    // m, between predicted and measured position of P
};

// Starts are `spacing` seconds apart, after the first second, which the filter needs. States at the
// start are those of a filter that knows `calibrated`; the prediction uses `constants`.
std::vector<OpenLoopError> PredictOpenLoop(const RotorAeroModel& model, const RotorData& data,
                                           const RotorNoise& noise,
                                           const RotorConstants& calibrated,
                                           const RotorConstants& constants,
                                           const std::vector<double>& horizons, double spacing);

}  // namespace trueline
