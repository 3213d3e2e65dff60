// The result files of trueline-benchmark, and its table. Except for solve times they depend on the
// experiment only, and neither on the number of threads nor on resuming.
#pragma once

#include <filesystem>
#include <string>

#include "problems/experiment/benchmark_summary.h"
#include "problems/experiment/job.h"

namespace trueline {

// arcs.csv (that of trueline-calibrate with the columns label, sweep, seed, bound ... added),
// summary.yaml, timing.yaml with the wall time, and if the experiment asks for them
// convergence.csv, starts.csv, trajectory.csv. With `times` false the column solve_time is empty,
// so that arcs.csv has the same bytes in every run.
void WriteBenchmark(const Experiment& experiment, const ExperimentRun& run, int threads, bool times,
                    const std::filesystem::path& directory);

// summary.yaml: groups, convergence, starts, failures, provenance. Independent of times and
// threads.
std::string SummaryYaml(const Experiment& experiment, const ExperimentRun& run);

// For standard output.
std::string BenchmarkTable(const Experiment& experiment, const ExperimentRun& run);
// The mean errors, and the median times of convergence, a column a log.
std::string BenchmarkBrief(const ExperimentRun& run);

}  // namespace trueline
