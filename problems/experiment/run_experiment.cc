#include "problems/experiment/run_experiment.h"

#include <atomic>
#include <chrono>
#include <fstream>
#include <optional>
#include <sstream>

#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/common/parallel.h"
#include "problems/common/progress.h"

namespace trueline {
namespace {

// The result of an earlier run; no value if its file is missing or damaged.
std::optional<JobResult> ReadJobFile(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) return std::nullopt;
  std::ostringstream text;
  text << file.rdbuf();
  try {
    return ParseJobResult(text.str(), path.string());
  } catch (const InputError&) {
    return std::nullopt;  // the job runs again
  }
}

// Every result is written and parsed again, so that a resumed run gives the same bytes.
JobResult RunAndStore(const Job& job, const std::filesystem::path& path) {
  const std::string text = ToText(RunJob(job));
  WriteFileAtomically(path, text);
  return ParseJobResult(text, path.string());
}

}  // namespace

BenchmarkRun RunJobs(const std::vector<Job>& jobs, const std::filesystem::path& jobs_folder,
                     int threads, bool quiet) {
  const auto start = std::chrono::steady_clock::now();
  const int count = static_cast<int>(jobs.size());
  BenchmarkRun run;
  run.outcomes.resize(jobs.size());
  std::atomic<int> reused{0};
  Progress progress(count, "flights", quiet);
  ParallelFor(count, threads, [&](int i) {
    JobOutcome& outcome = run.outcomes[i];
    outcome.job = jobs[i];
    const std::filesystem::path path = jobs_folder / (jobs[i].key + ".txt");
    try {
      auto earlier = ReadJobFile(path);
      reused += earlier.has_value();
      outcome.result = earlier ? std::move(*earlier) : RunAndStore(jobs[i], path);
    } catch (const InputError& error) {
      outcome.failure = error.what();
    }
    progress.Done();
  });
  run.reused = reused;
  run.wall_time = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return run;
}

}  // namespace trueline
