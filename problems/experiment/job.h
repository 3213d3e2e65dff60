// Jobs of an experiment: one flight each, on which all estimators run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
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

// Runs all jobs of an experiment on all cores. A killed run resumes.
struct JobOutcome {
  Job job;
  JobResult result;
  std::string failure;  // why there is no result; empty where there is one
};

struct ExperimentRun {
  std::vector<JobOutcome> outcomes;  // in the order of the jobs, whatever the threads
  int reused = 0;                    // jobs taken from files of an earlier run
  double wall_time = 0.0;            // s
};

// Each finished job writes a file in `jobs_folder`, named by its key, whole or not at all; a job
// with a file does not run again. A job that fails on bad input has `failure` and no file.
// `threads` 0: all cores.
ExperimentRun RunJobs(const std::vector<Job>& jobs, const std::filesystem::path& jobs_folder,
                      int threads, bool quiet);

// The text of the file of that key in the folder; if the file is missing or damaged, the text that
// `make` returns, which is then stored. An empty folder stores nothing.
struct StoredText {
  std::string text;
  bool reused = false;
};
StoredText ReuseOrMake(const std::filesystem::path& folder, const std::string& key,
                       const std::function<std::string()>& make);

// The key of a text that describes all inputs of a result. The program is one of them: rebuilt, it
// may give other results under the same version.
std::string KeyOf(const std::string& description);

}  // namespace trueline
