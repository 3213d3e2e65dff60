// The result files of a multi-step experiment.
#pragma once

#include <filesystem>
#include <string>

#include "problems/prediction/multi_step_experiment.h"

namespace trueline {

// summary.yaml (scores of both averages, the fitted numbers with sigma and unit, each fold's) and
// horizons.csv (mean errors at every horizon).
void WriteMultiStep(const MultiStepExperiment& experiment, const MultiStepResult& result,
                    const std::filesystem::path& directory);

// For standard output.
std::string MultiStepTable(const MultiStepExperiment& experiment, const MultiStepResult& result);

}  // namespace trueline
