// trueline-calibrate as a user runs it: a flight on disk, flags, exit code, both outputs.
#pragma once

#include "problems/log/native_log.h"
#include "problems/vgd/passes.h"
#include "tests/common/run_program.h"
#include "tests/simulation/short_flight.h"

namespace trueline {

// Each test has its own flight of 15 s round the hippodrome, which it may modify.
class CalibrateApp : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(App("calibrate"))) GTEST_SKIP() << "it is not built";
    WriteNativeLog(Flight(), root_ / "log");
  }

  static FlightLog Fly(std::uint64_t seed) {
    SimulationConfig config = testing_simulation::ReadShipped("hippodrome", 15.0);
    config.imu.rate = 200.0;
    return testing_simulation::Fly(config, seed).log;
  }
  static const FlightLog& Flight() {
    static const FlightLog log = Fly(3);
    return log;
  }

  // Runs it on the test's log with the usual flags and `more`.
  Outcome Calibrate(const std::string& more = "") const {
    return Run(fmt::format("--log='{}' --out='{}' --gamma_sweep= --report=false {}",
                           (root_ / "log").string(), (root_ / "out").string(), more));
  }

  static Outcome Run(const std::string& arguments) { return RunApp("calibrate", arguments); }

  // Lines of a file of the log, to be changed and written back.
  std::vector<std::string> Lines(const std::string& file) const {
    std::istringstream text(ReadText(root_ / "log" / file));
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    return lines;
  }
  void WriteLines(const std::string& file, const std::vector<std::string>& lines) const {
    std::ofstream out(root_ / "log" / file);
    for (const std::string& line : lines) out << line << "\n";
  }

  const TestFolder folder_;
  const std::filesystem::path root_ = folder_.directory();
};

}  // namespace trueline
