// The result files of an experiment with rotor-driven flights.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/experiment/rotor_experiment_summary.h"

namespace trueline {

// summary.yaml; trials.csv (each constant of each flight); history.csv (the filter's errors over
// time by kind: mean, spread between flights, RMSE, stated sigma); trajectory_KIND.yaml of each
// trajectory chosen by the experiment, with '_' for blanks in the name.
void WriteRotorExperiment(const RotorExperiment& experiment, const ExperimentRun& run,
                          const std::filesystem::path& directory);

// For standard output.
std::string RotorExperimentTable(const RotorExperiment& experiment, const ExperimentRun& run);

}  // namespace trueline
