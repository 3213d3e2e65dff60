// Experiments of a few seconds, in folders that vanish.
#pragma once

#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "problems/experiment/write_benchmark.h"
#include "tests/common/test_files.h"

namespace trueline::testing_benchmark {

namespace fs = std::filesystem;

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "trueline_benchmark_XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() { fs::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

inline fs::path SourceFolder() { return TRUELINE_TEST_SOURCE_DIR; }

// The simulation line of an experiment: 25 s of the hippodrome, with an IMU at 128 Hz.
inline std::string Hippodrome(const std::string& more = "") {
  return "simulations:\n  - config: " +
         (SourceFolder() / "config/simulate/hippodrome.yaml").string() +
         "\n    overrides: {duration: 25, warm_up: 3, imu.rate: 128" + more + "}\n";
}

inline fs::path WriteExperiment(const fs::path& folder, const std::string& text) {
  const fs::path file = folder / "experiment.yaml";
  std::ofstream(file) << text;
  return file;
}

inline ExperimentRun RunFile(const fs::path& file, const fs::path& out, int threads) {
  const Experiment experiment = ReadExperiment(file);
  ExperimentRun run = RunJobs(MakeJobs(experiment), out / "jobs", threads, true);
  WriteBenchmark(experiment, run, threads, false, out);
  return run;
}

}  // namespace trueline::testing_benchmark
