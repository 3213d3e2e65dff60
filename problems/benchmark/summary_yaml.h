#pragma once

#include <string>

#include "problems/benchmark/run_experiment.h"

namespace trueline {

// summary.yaml: groups, convergence, starts, failures, provenance. Independent of times and
// threads.
std::string SummaryYaml(const Experiment& experiment, const BenchmarkRun& run);

}  // namespace trueline
