// How a run's logged velocity follows from its logged position (fused_velocity.h).
#pragma once

#include <array>
#include <vector>

#include "cost_functions/models/fused_velocity.h"
#include "problems/prediction/prediction_run.h"

namespace trueline {

struct FusedVelocityFit {
  FusedVelocityNumbers numbers;
  // Of excess, time and lag: by the spread between runs, and between trajectories where that is
  // more.
  std::array<double, 3> sigmas = {};
};

// Least squares on the spectra of the horizontal velocities between 0.06 and 1.6 Hz, each
// trajectory with the same weight. Runs of less than 10 s are left out; the start is the result
// where no run is left.
FusedVelocityFit FitFusedVelocity(const std::vector<const PredictionRun*>& runs,
                                  const FusedVelocityNumbers& start);

}  // namespace trueline
