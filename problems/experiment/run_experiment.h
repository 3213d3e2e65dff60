// Runs all jobs of an experiment on all cores. A killed run resumes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/experiment/job.h"

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

// Each finished job writes a file in `jobs_folder`, named by its key, whole or not at all; a job
// with a file does not run again. A job that fails on bad input has `failure` and no file.
// `threads` 0: all cores.
BenchmarkRun RunJobs(const std::vector<Job>& jobs, const std::filesystem::path& jobs_folder,
                     int threads, bool quiet);

}  // namespace trueline
