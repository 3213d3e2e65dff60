#pragma once

#include <string>

#include "problems/experiment/run_jobs.h"

namespace trueline {

// summary.yaml: groups, convergence, starts, failures, provenance. Independent of times and
// threads.
std::string SummaryYaml(const Experiment& experiment, const ExperimentRun& run);

}  // namespace trueline
