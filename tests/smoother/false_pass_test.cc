// False passes (another object detected as the gate): named, and excluded from learning.
#include <gmock/gmock.h>

#include "problems/calibration/calibration.h"
#include "problems/smoother/smoother.h"
#include "tests/vgd/flights.h"

namespace trueline {
namespace {

using testing::HasSubstr;

testing_simulation::Flown Fly(double duration, int seed) {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome");
  config.duration = duration;
  config.warm_up = 5.0;
  return testing_simulation::Fly(config, seed);
}

FlightData DataOf(const FlightLog& log) {
  const VgdOptions options;
  return {log, options.drive, options.passes, options.drag_measurement};
}

EstimatorRun Smooth(const FlightLog& log, double probability) {
  SmootherOptions options;
  options.false_pass.probability = probability;
  return RunSmoother(DataOf(log), VgdOptions(), options);
}

int FalseAlarms(const EstimatorRun& run) {
  int count = 0;
  for (const std::string& warning : run.warnings) {
    count += warning.find("looks false") != std::string::npos;
  }
  return count;
}

// All fixes of the given passes (from 0) are of an object displaced from the gate by `d`.
FlightLog WithFalsePasses(FlightLog log, const std::vector<int>& passes, const Eigen::Vector3d& d) {
  const std::vector<Pass> found = FindPasses(log.fixes, PassOptions());
  for (const int k : passes) {
    for (std::size_t i = found[k].first; i <= found[k].last; ++i) log.fixes[i].p_E -= d;
  }
  return log;
}

TEST(FalsePass, SlowIsNamedAndDoesNoHarm) {
  const Eigen::Vector3d d(0.5, 3.0, 0.0);  // m
  const FlightLog clean = Fly(40.0, 1).log;
  const FlightLog spoilt = WithFalsePasses(clean, {2, 5}, d);
  const EstimatorRun sure = Smooth(clean, 0.05), robust = Smooth(spoilt, 0.05),
                     naive = Smooth(spoilt, 0.0);
  EXPECT_THAT(robust.warnings, testing::ElementsAre(HasSubstr("pass 3 "), HasSubstr("pass 6 ")));
  EXPECT_EQ(FalseAlarms(naive), 0);
  const double error = SummariseArcs(robust).error.mean;
  EXPECT_LT(error, 1.5 * SummariseArcs(sure).error.mean);
  EXPECT_LT(error, 0.6 * SummariseArcs(naive).error.mean);
}

TEST(FalsePass, SlowGoodFlightsRaiseNoAlarm) {
  int alarms = 0, passes = 0;
  for (int seed = 11; seed <= 14; ++seed) {
    const EstimatorRun run = Smooth(Fly(30.0, seed).log, 0.05);
    passes += static_cast<int>(run.windows.size());
    alarms += FalseAlarms(run);
  }
  ASSERT_GE(passes, 25);
  EXPECT_LE(alarms, 1);
}

}  // namespace
}  // namespace trueline
