// How a run's logged velocity follows from its logged position (fused_velocity.h).
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "problems/prediction/prediction_run.h"

namespace trueline {

// A window's velocities as a model predicts them, and the way that the logged ones do not explain.
struct WayWindow {
  static constexpr int kEvery = 5, kCompared = FusedVelocity::kSteps / kEvery;  // steps
  std::array<double, 2> v0;                                                     // m/s
  std::array<FusedVelocity::Axis<double>, 2> v;
  // p(h) - p(0) minus the integral of the logged velocity [m].
  Eigen::Matrix<double, 2, kCompared> way;
  int run = 0, trajectory = 0;  // indices
  double weight = 1.0;
};
// `v`: predicted from `row` on.
WayWindow WayOf(const PredictionRun& run, int row,
                const std::array<FusedVelocity::Axis<double>, 2>& v);

struct FusedVelocityFit {
  FusedVelocityNumbers numbers;
  // Of excess, time and lag: by the spread between runs, and between trajectories where that is
  // more.
  std::array<double, 3> sigmas = {};
};

// Minimises over windows and horizons the sum of the norms of what the correction leaves of the
// way. Every trajectory counts alike, by its sum without a correction.
FusedVelocityFit FitFusedVelocity(std::vector<WayWindow> windows, const FusedVelocityNumbers& start,
                                  int threads);

}  // namespace trueline
