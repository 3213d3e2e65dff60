// The numbers of the attitude's processes, from the errors of the rates that they expect.
#pragma once

#include "problems/prediction/fit_prediction.h"
#include "problems/prediction/training_windows.h"

namespace trueline {

// Fits the processes' numbers (not the sizes) to the rates of the windows, for given numbers of the
// vehicle. The model's net accelerations are those under the processes as they come in. A weak
// prior keeps each number within a factor of about e of the setup's. `threads` 0: all cores.
void FitProcesses(const PredictionSetup& setup, const std::vector<double>& numbers,
                  const std::vector<TrainingWindow>& windows, int threads,
                  ProcessNumbers* processes);

}  // namespace trueline
