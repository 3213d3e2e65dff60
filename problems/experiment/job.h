// Jobs of an experiment: one flight each, on which all estimators run.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "problems/calibration/estimators.h"
#include "problems/experiment/experiment.h"
#include "problems/experiment/rotor_experiment.h"
#include "problems/experiment/rows.h"
#include "problems/import/convert.h"
#include "problems/simulation/config.h"

namespace trueline {

struct ForeignLog {
  ImportMap map;
  std::vector<std::string> files;
  ConvertOptions options;
};

// A simulated flight, a native log's directory, a foreign log, or a rotor-driven flight.
using JobFlight = std::variant<SimulationConfig, std::filesystem::path, ForeignLog,
                               std::shared_ptr<const RotorFlightKind>>;

struct JobEstimator {
  std::string name;
  std::string label;
  EstimatorOptions options;
  std::vector<int> gammas;
};

// Fully resolved: the result depends on nothing else. Threads must not share YAML nodes, so a job
// uses none. A rotor-driven flight needs log, seed, flight and key only.
struct Job {
  std::string log;  // name of its flight source, or kind of flight
  std::uint64_t seed = 0;
  int sweep_index = 0;
  double x = 0.0;  // the sweep's value; NaN where there is none
  JobFlight flight;
  std::vector<JobEstimator> estimators;
  int starts = 0;
  std::vector<double> forecast;  // horizons, s
  std::map<std::string, double> convergence;
  bool paths = false;
  std::string bound;  // label whose model gives the bound; empty: none
  std::string key;    // checksum of all of this, of the files read and of the program
};

// All jobs: flights x sweep x seeds, in this order. A log without random numbers has one seed.
// Throws InputError naming the experiment's line for settings that a flight or estimator refuses.
std::vector<Job> MakeJobs(const Experiment& experiment);

// The same of an experiment with rotor-driven flights: kinds x flights. Paths that the experiment
// designs and noise that it learns are stored in `jobs_folder` (see ReuseOrMake).
std::vector<Job> MakeRotorJobs(const RotorExperiment& experiment,
                               const std::filesystem::path& jobs_folder, int threads, bool quiet);

// Flies or reads the flight and runs every estimator on it. Throws InputError where that fails.
JobResult RunJob(const Job& job);

}  // namespace trueline
