// The experiment of Boehm et al. 2020, sec. III, and similar ones. Trajectories of several kinds
// are each flown many times in simulation and calibrated by filter, by an ordinary extended filter
// (as published: no pass is flown again) and by batch from random initial guesses; the Cramer-Rao
// bound of each flight is reported beside the errors.
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
//   passes: 8                               # over the filter's first seconds; 0: ordinary filter
//   learn_noise: false                      # true: from the first flight of each kind
//   learn_delays: false                     # true: of rotor speeds and gyroscope, from each flight
//   kinds:
//     - {name: random, kind: random}        # a new trajectory for each flight
//     - {name: best Lissajous, kind: lissajous, best_of: 40, by: [r_BP_x, r_BP_y, r_BP_z]}
//     - {name: designed, kind: file, file: ../rotors/designed_r_BP.yaml}
//     - {name: evolved, kind: evolved, evaluations: 1800}  # from the best Lissajous, by its bound
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/calibration/rotor_calibration.h"
#include "problems/experiment/rows.h"
#include "problems/rotor/rotor_ekf.h"
#include "problems/simulation/simulate_rotor_flight.h"

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
  bool learn_delays = false;
  bool widen = true;                         // see RotorBatchOptions
  std::vector<ConsideredEffect> unmodelled;  // sizes are drawn for each flight
  std::vector<ConsideredEffect> considered;
  double duration = 20.0;  // s
  int flights = 10;
  int passes = RotorEkfOptions().passes;  // of the filter's first seconds; 0: an ordinary filter
  std::uint64_t seed = 1;
  std::vector<FlightKindSource> kinds;
  YAML::Node config;  // for provenance

  explicit RotorExperiment(RotorSimulation flown) : simulation(std::move(flown)) {}
};

// A kind of flight, ready to be flown.
struct RotorFlightKind {
  RotorExperiment experiment;
  std::optional<PiecewisePolynomial> path;  // of all its flights, if they share one
  RotorNoise noise;                         // the estimators'
};

// True for a file of config/experiments with `drive: rotors`.
bool IsRotorExperiment(const std::filesystem::path& file);
// Throws InputError naming file, line and key.
RotorExperiment ReadRotorExperiment(const std::filesystem::path& file);
// The same experiment shortened for a test: two flights of 5 s for each kind, best of 3 figures.
void ShortenRotorExperiment(RotorExperiment* experiment);

// Simulates a flight and calibrates it by filter and batch from a random initial guess. Throws
// InputError if the vehicle departs from its path or the batch does not converge.
TrialRow FlyTrial(const RotorFlightKind& kind, std::uint64_t seed);

}  // namespace trueline
