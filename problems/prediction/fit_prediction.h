// The rotor-driven model fitted to runs by multi-step least squares.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/effects/effect.h"
#include "problems/prediction/prediction_run.h"
#include "problems/rotor/rotor_vehicle.h"

namespace trueline {

// What is predicted by the rotor drive's model.
struct PredictedVehicle {
  RotorVehicle stated{RotorDrivenModel({}), {}};
  std::vector<Effect> effects;      // as in model.yaml; their sizes are numbers
  std::vector<RotorEffects> units;  // of FittedRotors, one for each size

  FittedRotors Model() const { return {stated.model.rotors(), stated.model.gravity(), units}; }
};

using ProcessNumbers = std::array<StabilisedProcessNumbers, WindowPrediction::kProcesses>;
// The processes' names in files.
inline constexpr std::array<const char*, WindowPrediction::kProcesses> kProcessNames = {"level",
                                                                                        "heading"};
WindowPrediction::Process MakeProcesses(const ProcessNumbers& numbers);
// Of WindowPrediction's numbers.
FusedVelocityNumbers VelocityNumbers(const std::vector<double>& numbers);

struct PredictionSetup {
  PredictedVehicle vehicle;
  std::vector<FittedNumber> numbers;  // of WindowPrediction
  ProcessNumbers processes = {};
  bool learn_processes = true;
  int windows = 600;  // of each trajectory, evenly spaced
  int rounds = 2;     // of vehicle and processes in turns
  int iterations = 12;
};

// By quantity (p, v, R, w) and step.
using QuantitySteps = std::array<std::array<double, PredictionWindow::kSteps>, 4>;
// By chance (kTubeChances); tube.h.
using Tube = std::array<QuantitySteps, 2>;

struct PredictionFit {
  std::vector<double> numbers;  // of WindowPrediction
  // One standard deviation by the spread between runs, and between trajectories where that is more
  // (sandwich with runs or trajectories as clusters); 0 for numbers that are held.
  std::vector<double> sigmas;
  ProcessNumbers processes;
  Tube tube;          // factors on the processes' spread
  double cost = 0.0;  // mean over windows of the scaled errors' sum
  int windows = 0;
  bool converged = false;
};

// The parts of a prediction with a fit's processes and numbers of the state; its addresses stay.
struct PredictionModel {
  FittedRotors rotors;
  WindowPrediction::Process process;
  FusedVelocity velocity;
  FastVelocity fast;
  WindowPrediction prediction;

  PredictionModel(const PredictedVehicle& vehicle, const ProcessNumbers& processes,
                  const std::vector<double>& numbers);
  PredictionModel(const PredictionModel&) = delete;
  PredictionModel& operator=(const PredictionModel&) = delete;
};

// Minimises the sum of the norms of the errors of velocity, attitude and rate over
// horizons and windows. Each trajectory counts alike: its weight is the inverse of its number of
// windows and of its mean change of rate. The processes' numbers are fitted in turns with the
// vehicle's, by the errors of the rates. What relates velocity to position is fitted last, by the
// predicted velocities (fit_fused_velocity.h).
PredictionFit FitPrediction(const PredictionSetup& setup,
                            const std::vector<const PredictionRun*>& runs, int threads);

}  // namespace trueline
