// Runs all jobs of an experiment on all cores. A killed run resumes.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "problems/experiment/job.h"

namespace trueline {

struct JobOutcome {
  Job job;
  JobResult result;
  std::string failure;  // why there is no result; empty where there is one
};

struct ExperimentRun {
  std::vector<JobOutcome> outcomes;  // in the order of the jobs, whatever the threads
  int reused = 0;                    // jobs taken from files of an earlier run
  double wall_time = 0.0;            // s
};

// Each finished job writes a file in `jobs_folder`, named by its key, whole or not at all; a job
// with a file does not run again. A job that fails on bad input has `failure` and no file.
// `threads` 0: all cores.
ExperimentRun RunJobs(const std::vector<Job>& jobs, const std::filesystem::path& jobs_folder,
                      int threads, bool quiet);

// The text of the file of that key in the folder; if the file is missing or damaged, the text that
// `make` returns, which is then stored. An empty folder stores nothing.
struct StoredText {
  std::string text;
  bool reused = false;
};
StoredText ReuseOrMake(const std::filesystem::path& folder, const std::string& key,
                       const std::function<std::string()>& make);

// The key of a text that describes all inputs of a result. The program is one of them: rebuilt, it
// may give other results under the same version.
std::string KeyOf(const std::string& description);

}  // namespace trueline
