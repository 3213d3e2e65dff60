// A comparison of estimators, as its YAML file states it (config/experiments/).
//
//   name: Figure 11
//   about: what it shows, a sentence for the report             # optional
//   simulations:
//     - name: hippodrome                                        # optional
//       config: ../simulate/hippodrome.yaml                     # relative to this file
//       overrides: {duration: 60, detector.sigma_factor: 0.2}   # key paths of that file
//       randomise: true                                         # draw true parameters by seed
//       options: {drive: {thrust: level_flight}}                # of all estimators, on this flight
//   logs:
//     - {log: "${TRUELINE_DATA}/flight"}                        # a native log
//     - {map: ../import/nanobench.yaml, in: ["${TRUELINE_DATA}/B7.csv"],
//        fixes: {sigma_factor: 0.2}}                            # of fixes_from_mocap
//   seeds: {first: 1, count: 100}
//   estimators:
//     - name: vgd
//       label: VGD as published
//       config: ../calibrate/paper.yaml                         # options, as trueline-calibrate
//       options: {priors: {...}}                                # takes, and on top of these some
//       gammas: [3]                                             # instead of the ones below
//   gammas: [1, 2, 3, 4, 5]
//   sweep:
//     {name: sigma factor, unit: "1", keys: [simulation.detector.sigma_factor, fixes.sigma_factor],
//      values: [0.02, 0.1]}
//     # or: points: [{x: 3, set: {simulation.detector.fixes: [3, 3], fixes.min_count: 3}}]
//     # roots: simulation (simulations), fixes (logs with sampled fixes), options (estimators)
//   starts: {count: 20}                  # study of random starts (Table 2) of every VGD window
//   forecast: [0.1, 0.5, 1]              # s after the last fix of every VGD window, against mocap
//   convergence: {b_az: 0.1, final_point_error: 1.0}   # tolerances, SI
//   trajectories: true                   # of the first job, for plots
//   bound: VGD                           # Cramer-Rao bound of each arc of simulated flights, by
//                                        # the model of that label and the flight's true noise
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/experiment/overlay.h"

namespace trueline {

enum class FlightKind { kSimulation, kNativeLog, kForeignLog };

// A source of flights: one entry of `simulations` or `logs`.
struct FlightSource {
  FlightKind kind = FlightKind::kSimulation;
  std::string name;
  std::filesystem::path file;       // configuration, log directory or column map
  std::vector<std::string> inputs;  // of a foreign log
  bool randomise = false;
  std::vector<Setting> settings;  // of the configuration, or of fixes_from_mocap
  YAML::Node options;             // of all estimators on this flight
  int line = 0;                   // in the experiment
};

struct EstimatorSource {
  std::string name;
  std::string label;
  std::filesystem::path file;  // of options; empty: none
  YAML::Node options;          // on top of those of the file and of the flight
  std::vector<int> gammas;
  int line = 0;
};

struct SweepPoint {
  double x = 0.0;
  std::vector<Setting> settings;  // paths with their root
};

struct Sweep {
  std::string name;
  std::string unit;
  std::vector<SweepPoint> points;
};

struct Experiment {
  std::string file;
  std::string name;
  std::string about;
  std::vector<FlightSource> flights;
  std::vector<EstimatorSource> estimators;
  std::uint64_t first_seed = 1;
  int seeds = 1;
  Sweep sweep;  // without points: none
  int starts = 0;
  std::vector<double> forecast;               // horizons, s
  std::map<std::string, double> convergence;  // tolerance by quantity
  bool trajectories = false;
  std::string bound;  // label whose model gives the bound; empty: none
  YAML::Node config;  // the file as it is, for provenance
};

// All files that a flight source reads.
std::vector<std::filesystem::path> FilesOf(const FlightSource& source);

// Throws InputError with file, line and key for what is unknown, missing or out of range.
Experiment ReadExperiment(const std::filesystem::path& file);

// The same experiment shortened for a test: one seed, the ends of the sweep, 30 s of simulated
// flight.
void ShortenExperiment(Experiment* experiment);

}  // namespace trueline
