// The windows that a prediction model is fitted to.
#pragma once

#include <vector>

#include "problems/prediction/prediction_run.h"

namespace trueline {

struct TrainingWindow {
  PredictionWindow window;
  WindowTruth truth;
  double weight = 1.0;
  int run = 0;         // index of the run
  int trajectory = 0;  // index of the trajectory
};

// About `count` windows of each trajectory, evenly spaced over its runs. A trajectory's weights sum
// to the same number times the inverse of its mean |w(t + h) - w(t)|; the mean of all weights is 1.
std::vector<TrainingWindow> ChooseWindows(const std::vector<const PredictionRun*>& runs, int count);

}  // namespace trueline
