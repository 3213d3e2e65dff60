// The experiment of Boehm et al. 2020, sec. III, and similar ones. Trajectories of several kinds
// are each flown many times in simulation and calibrated by filter and batch from random initial
// guesses; the Cramer-Rao bound of each flight is reported beside the errors.
//
//   drive: rotors
//   name: ...; about: ...
//   vehicle, biases, limits, simulation     # as config/rotors/random.yaml
//   duration: 20                            # s, of random flights and figures
//   flights: 10                             # of each kind
//   seed: 1
//   prior: {...}                            # as trueline-calibrate; guesses are drawn from it
//   noise: {...}                            # the estimators'; left out: the simulation's
//   unmodelled: {rotor_loss: {factor: 0.01}}  # effects in each flight that no estimator models:
//                                             # sigmas; sizes are drawn for each flight
//   consider: {rotor_loss: {factor: 0.01}}  # widens intervals; as trueline-calibrate
//   learn_noise: false                      # true: from the first flight of each kind
//   kinds:
//     - {name: random, kind: random}        # a new trajectory for each flight
//     - {name: best Lissajous, kind: lissajous, best_of: 40, by: [r_BP_x, r_BP_y, r_BP_z]}
//     - {name: designed, kind: file, file: ../rotors/designed_r_BP.yaml}
//     - {name: evolved, kind: evolved, evaluations: 1800}  # from the best Lissajous, by its bound
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "problems/calibration/rotor_calibration.h"
#include "problems/rotor_ekf/rotor_ekf.h"
#include "problems/rotor_simulation/simulate_rotor_flight.h"

namespace trueline {

struct FlightKindSource {
  std::string name;
  std::string kind;     // random | lissajous | evolved | file
  std::string file;     // a trajectory.yaml
  int best_of = 40;     // figures, of which the one with the smallest bound is flown
  int evaluations = 0;  // evaluations of the bound for evolving it
  std::vector<int> by;  // constants whose bound is the score
};

struct RotorExperiment {
  std::string file, name, about;
  RotorSimulation simulation;
  RotorPrior prior;
  RotorNoise believed;
  bool learn_noise = false;
  bool widen = true;                         // see RotorBatchOptions
  std::vector<ConsideredEffect> unmodelled;  // sizes are drawn for each flight
  std::vector<ConsideredEffect> considered;
  double duration = 20.0;  // s
  int flights = 10;
  std::uint64_t seed = 1;
  std::vector<FlightKindSource> kinds;
  YAML::Node config;  // for provenance

  explicit RotorExperiment(RotorSimulation flown) : simulation(std::move(flown)) {}
};

// One flight, calibrated. Errors are estimate less truth.
struct RotorTrial {
  int kind = 0;
  std::uint64_t seed = 0;
  std::string failure;         // empty where all went well
  RotorConstants first_guess;  // less truth
  RotorConstants filter_error, filter_sigma;
  RotorConstants batch_error, batch_sigma;
  RotorConstants bound;                        // sigma
  double filter_nees = 0.0, batch_nees = 0.0;  // by degree of freedom
  double path_error = 0.0;                     // m
  std::vector<RotorEstimate> history;          // of the filter, errors in `mean`
};

// True for a file of config/experiments with `drive: rotors`.
bool IsRotorExperiment(const std::filesystem::path& file);
// Throws InputError naming file, line and key.
RotorExperiment ReadRotorExperiment(const std::filesystem::path& file);
// The same experiment shortened for a test: two flights of 5 s for each kind, best of 3 figures.
void ShortenRotorExperiment(RotorExperiment* experiment);

struct RotorExperimentRun {
  std::vector<RotorTrial> trials;
  std::vector<std::optional<PiecewisePolynomial>> paths;  // for each kind whose flights share one
                                                          // path
};

// The result does not depend on `threads`.
RotorExperimentRun RunRotorExperiment(const RotorExperiment& experiment, int threads,
                                      const std::function<void(const std::string&)>& progress);

}  // namespace trueline
