// What faults of the log leave of a verdict.
#include "problems/diagnosis/log_faults.h"

#include "tests/common/matchers.h"

namespace trueline {
namespace {

std::string JudgedWith(const std::string& verdict, const LogFault& fault) {
  Diagnosis diagnosis;
  diagnosis.verdict = verdict;
  AddLogFaults({fault}, &diagnosis);
  EXPECT_THAT(diagnosis.log_faults, ElementsAre(fault.text));
  return diagnosis.verdict;
}

TEST(LogFaults, AFatalFaultExplainsNothing) {
  const LogFault axes{"log", &fault::kAccelerometerAxes,
                      "",    0.0,
                      true,  "accelerometer_axes: x and y are exchanged"};
  EXPECT_EQ(JudgedWith("clean", axes), "unexplained");
  EXPECT_EQ(JudgedWith("explained", axes), "unexplained");
}

TEST(LogFaults, AFatalFaultLeavesNoEffectInTheModel) {
  Diagnosis diagnosis;
  diagnosis.in_model = {Effect{}};
  diagnosis.open.described.resize(1);
  diagnosis.open.described[0].in_model = true;
  AddLogFaults({{"log", &fault::kStuck, "", 0.0, false, "stuck"}}, &diagnosis);
  EXPECT_EQ(diagnosis.in_model.size(), 1U);
  AddLogFaults({{"log", &fault::kAccelerometerAxes, "", 0.0, true, "accelerometer_axes"}},
               &diagnosis);
  EXPECT_TRUE(diagnosis.in_model.empty());
  EXPECT_FALSE(diagnosis.open.described[0].in_model);
  EXPECT_THAT(diagnosis.model_lacks, HasSubstr("fatal"));
}

TEST(LogFaults, AnotherFaultIsNotClean) {
  const LogFault stuck{"log", &fault::kStuck, "", 0.0, false, "stuck: mocap.csv stands still"};
  EXPECT_EQ(JudgedWith("clean", stuck), "unexplained");
  EXPECT_EQ(JudgedWith("explained", stuck), "explained");
}

TEST(LogFaults, WhatTheCatalogueStatesIsJudgedByTheSearch) {
  const LogFault scale{"log", &fault::kAccelerometerScale, "", 0.0,
                       false, "accelerometer_scale: 0.9"};
  EXPECT_EQ(JudgedWith("clean", scale), "clean");
  EXPECT_EQ(JudgedWith("ambiguous", scale), "ambiguous");
}

TEST(LogFaults, NoneLeaveTheVerdict) {
  Diagnosis diagnosis;
  diagnosis.verdict = "clean";
  AddLogFaults({}, &diagnosis);
  EXPECT_EQ(diagnosis.verdict, "clean");
}

TEST(LogFaults, AFurtherFlightThatIsWrongConfirmsNothing) {
  std::vector<FlightLog> logs(3);
  const char* const names[] = {"a", "b", "c"};
  for (std::size_t i = 0; i < logs.size(); ++i) logs[i].directory = names[i];
  logs[2].warnings = {"stuck (biases): x"};
  std::vector<LogFault> faults = {{"a", &fault::kStuck, "mocap", 0.0, false, "stuck: a"},
                                  {"b", &fault::kClockOffset, "imu", 1.0, true, "clock_offset: b"},
                                  {"c", &fault::kStuck, "imu", 0.0, false, "stuck: c"}};
  LeaveOutFaultyFlights(&logs, &faults);
  ASSERT_EQ(logs.size(), 2U);
  EXPECT_EQ(logs[1].directory, "c");
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].log, "a");
  EXPECT_THAT(logs[0].warnings,
              UnorderedElementsAre("c: stuck (biases): x", HasSubstr("b: has a")));
}

}  // namespace
}  // namespace trueline
