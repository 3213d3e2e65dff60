// Tubes about predicted windows: balls about position, velocity, attitude and rate at every step
// that hold the flight with a stated chance.
//
// How far a prediction errs goes with the manoeuvre. The processes of the attitude say by how much
// (StabilisedProcess::Spreads): of rate and angle directly, of velocity and position by the gravity
// that a wrong tilt turns. A radius is that spread times a factor, which belongs to the chance, the
// quantity and the step: the quantile over training windows, in which every trajectory counts
// alike.
//
// Trajectories differ in that factor by up to two, and nothing that a window shows tells which it
// will be: it is a random effect of the flight. So the factors follow the run: a step that a tube
// has missed raises its factor, one that it has held lowers it, once that step is flown (online
// conformal prediction with decaying steps, Angelopoulos et al. 2024). Whatever the errors'
// distribution, the shares that are held come near to the chances.
#pragma once

#include <deque>
#include <vector>

#include "problems/prediction/fit_prediction.h"
#include "problems/prediction/multi_step_score.h"

namespace trueline {

inline constexpr std::array<double, std::tuple_size_v<Tube>> kTubeChances = {0.5, 0.95};

// A window's prediction, its spread by quantity and step [m, m/s, rad, rad/s], and the errors over
// that spread.
struct SpreadStates {
  WindowStates states;
  QuantitySteps spread, ratios;
};
SpreadStates PredictSpread(const PredictionModel& model, const std::vector<double>& numbers,
                           const PredictionRun& run, int row);

// The factors of one run's windows, in the order of their starts.
class FollowedFactors {
 public:
  explicit FollowedFactors(const Tube& learned) : factors_(learned) {}

  // Of the window that starts at `row`: by the learned ones, and by the steps of earlier windows
  // that are flown at `row`. Its own `ratios` count once they are flown, too.
  Tube Next(int row, const QuantitySteps& ratios);

 private:
  struct Window {
    int row, known;  // start, steps that are flown
    double gain;
    Tube held;
  };
  Tube factors_;
  std::deque<Window> windows_;
  int last_row_ = 0;
};

// The learned factors.
Tube LearnTube(const PredictionModel& model, const std::vector<double>& numbers,
               const std::vector<const PredictionRun*>& runs,
               const std::vector<TrainingWindow>& windows, int threads);

// The share of all windows of `runs` that the tubes hold, by the learned factors alone and by those
// that follow the run.
struct TubeShares {
  Tube learned = {}, followed = {};
};
TubeShares ShareHeld(const PredictionModel& model, const PredictionFit& fit,
                     const std::vector<const PredictionRun*>& runs, int threads);

}  // namespace trueline
