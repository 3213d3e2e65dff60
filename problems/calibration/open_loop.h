// Open-loop prediction on held-out flight: from the filter's state at one time, rotor speeds alone
// predict the position a horizon later.
#pragma once

#include <vector>

#include "problems/rotor/rotor_ekf.h"

namespace trueline {

struct OpenLoopError {
  double t;        // s, of the start
  double horizon;  // s
  double error;    // m, between predicted and measured position of P
};

// Predictions start every `spacing` seconds, after one second in which the filter converges. Their
// initial states come from a filter that holds `calibrated`; the prediction uses `constants`. Empty
// if that filter diverges.
std::vector<OpenLoopError> PredictOpenLoop(const RotorAeroModel& model, const RotorData& data,
                                           const RotorNoise& noise,
                                           const RotorConstants& calibrated,
                                           const RotorConstants& constants,
                                           const std::vector<double>& horizons, double spacing);

// The same with the filter's constants, and how large the filter states the error to be.
std::vector<RotorForecast> ForecastOpenLoop(const RotorAeroModel& model, const RotorData& data,
                                            const RotorNoise& noise,
                                            const RotorConstants& calibrated,
                                            const std::vector<double>& horizons, double spacing);

}  // namespace trueline
