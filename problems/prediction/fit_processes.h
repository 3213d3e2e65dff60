// The numbers of the attitude's processes, from the errors of the rates that they expect.
#pragma once

#include <vector>

#include "problems/prediction/fit_prediction.h"
#include "problems/prediction/prediction_run.h"

namespace trueline {

// The windows that a prediction model is fitted to.
struct TrainingWindow {
  PredictionWindow window;
  WindowTruth truth;
  double weight = 1.0;
  int run = 0;         // index of the run
  int row = 0;         // its start
  int trajectory = 0;  // index of the trajectory
};

// About `count` windows of each trajectory, evenly spaced over its runs. A trajectory's weights sum
// to the same number times the inverse of its mean |w(t + h) - w(t)|; the mean of all weights is 1.
std::vector<TrainingWindow> ChooseWindows(const std::vector<const PredictionRun*>& runs, int count);

// Fits the processes' numbers (not the sizes) to the rates of the windows, for given numbers of the
// vehicle. The model's net accelerations are those under the processes as they come in. A weak
// prior keeps each number within a factor of about e of the setup's. `threads` 0: all cores.
void FitProcesses(const PredictionSetup& setup, const std::vector<double>& numbers,
                  const std::vector<TrainingWindow>& windows, int threads,
                  ProcessNumbers* processes);

}  // namespace trueline
