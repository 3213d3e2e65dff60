// The result files of trueline-benchmark, and its table. All but the solver's times depend on the
// experiment only, not on the number of threads, nor on whether a run was resumed.
#pragma once

#include <filesystem>
#include <string>

#include "problems/benchmark/benchmark_summary.h"
#include "problems/benchmark/run_experiment.h"

namespace trueline {

// arcs.csv (interfaces, with the columns label, sweep, seed, bound ... added), summary.yaml, and
// where the experiment asks for them convergence.csv, starts.csv, trajectory.csv; timing.yaml with
// the wall time. With `times` false the column solve_time stays empty, so that arcs.csv has the
// same bytes in every run.
void WriteBenchmark(const Experiment& experiment, const BenchmarkRun& run, int threads, bool times,
                    const std::filesystem::path& directory);

// For standard output.
std::string BenchmarkTable(const Experiment& experiment, const BenchmarkRun& run);

}  // namespace trueline
