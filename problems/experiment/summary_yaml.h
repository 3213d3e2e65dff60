#pragma once

#include <string>

#include "problems/experiment/run_experiment.h"

namespace trueline {

// summary.yaml: groups, convergence, starts, failures, provenance. Independent of times and
// threads.
std::string SummaryYaml(const Experiment& experiment, const BenchmarkRun& run);

}  // namespace trueline
