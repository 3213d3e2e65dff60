// The rotor-by-rotor model fitted to runs by multi-step least squares.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/prediction/prediction_run.h"

namespace trueline {

// A number of the model (kRotorAirNumbers, then kStateNumbers).
struct PredictionNumber {
  double start = 0.0;
  double typical = 1.0;  // its unit in the solver
  bool free = false;
};

using ProcessNumbers = std::array<StabilisedProcessNumbers, WindowPrediction::kProcesses>;
// The processes' names in files.
inline constexpr std::array<const char*, WindowPrediction::kProcesses> kProcessNames = {"level",
                                                                                        "heading"};
WindowPrediction::Process MakeProcesses(const ProcessNumbers& numbers);
// Of WindowPrediction's numbers.
FusedVelocityNumbers VelocityNumbers(const std::vector<double>& numbers);

struct PredictionSetup {
  RotorAirVehicle vehicle;
  std::vector<PredictionNumber> numbers;  // WindowPrediction::kCount
  ProcessNumbers processes = {};
  bool learn_processes = true;
  int windows = 600;  // of each trajectory, evenly spaced
  int rounds = 2;     // of vehicle and processes in turns
  int iterations = 12;
};

// Name, unit and meaning of number `i`.
const RotorAirInfo& PredictionNumberInfo(int i);

// By quantity (p, v, R, w) and step.
using QuantitySteps = std::array<std::array<double, PredictionWindow::kSteps>, 4>;
// By chance (kTubeChances); tube.h.
using Tube = std::array<QuantitySteps, 2>;

struct PredictionFit {
  std::vector<double> numbers;  // WindowPrediction::kCount
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
  RotorAir air;
  WindowPrediction::Process process;
  FusedVelocity velocity;
  FastVelocity fast;
  WindowPrediction prediction;

  PredictionModel(const RotorAirVehicle& vehicle, const ProcessNumbers& processes,
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
