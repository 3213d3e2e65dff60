// Tubes about predicted windows: balls about position, velocity, attitude and rate at every step
// that hold the flight with a stated chance.
//
// How far a prediction errs goes with the manoeuvre. The processes of the attitude say by how much
// (StabilisedProcess::Spreads): of rate and angle directly, of velocity and position by the gravity
// that a wrong tilt turns. A radius is that spread times a factor, which belongs to the chance, the
// quantity and the step: the quantile over training windows, in which every trajectory counts
// alike.
#pragma once

#include <vector>

#include "problems/prediction/fit_processes.h"
#include "problems/prediction/multi_step_score.h"

namespace trueline {

inline constexpr std::array<double, std::tuple_size_v<Tube>> kTubeChances = {0.5, 0.95};

// A window's prediction, and the radii of its tube by chance, quantity and step [m, m/s, rad,
// rad/s].
struct TubedStates {
  WindowStates states;
  Tube radii;
};
TubedStates PredictTube(const PredictionModel& model, const std::vector<double>& numbers,
                        const Tube& factors, const PredictionRun& run, int row);

// The factors.
Tube LearnTube(const PredictionModel& model, const std::vector<double>& numbers,
               const std::vector<const PredictionRun*>& runs,
               const std::vector<TrainingWindow>& windows, int threads);

// The share of all windows of `runs` that the tubes hold.
Tube ShareHeld(const PredictionModel& model, const PredictionFit& fit,
               const std::vector<const PredictionRun*>& runs, int threads);

}  // namespace trueline
