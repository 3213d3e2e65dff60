// All jobs of an experiment on all cores. A run that was killed goes on where it stopped.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/benchmark/job.h"

namespace trueline {

struct JobOutcome {
  Job job;
  JobResult result;
  std::string failure;  // why there is no result; empty where there is one
};

struct BenchmarkRun {
  std::vector<JobOutcome> outcomes;  // in the order of MakeJobs, whatever the threads
  int reused = 0;                    // jobs taken from files of an earlier run
  double wall_time = 0.0;            // s
};

// Each finished job leaves a file in `jobs_folder`, named by its key, written whole or not at all;
// a job with a file is not run again. A job that fails by bad input is an outcome with `failure`
// and leaves no file. `threads` 0: all cores.
BenchmarkRun RunJobs(const std::vector<Job>& jobs, const std::filesystem::path& jobs_folder,
                     int threads, bool quiet);

}  // namespace trueline
