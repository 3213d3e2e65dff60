// What faults of the log leave of a verdict.
#include "problems/diagnosis/log_faults.h"

#include <gmock/gmock.h>

namespace trueline {
namespace {

std::string VerdictWith(const std::string& verdict, const LogFault& fault) {
  Diagnosis diagnosis;
  diagnosis.verdict = verdict;
  AddLogFaults({fault}, &diagnosis);
  EXPECT_THAT(diagnosis.log_faults, testing::ElementsAre(fault.text));
  return diagnosis.verdict;
}

TEST(LogFaults, AFatalFaultExplainsNothing) {
  const LogFault axes{"accelerometer_axes", true, "accelerometer_axes: x and y are exchanged"};
  EXPECT_EQ(VerdictWith("clean", axes), "unexplained");
  EXPECT_EQ(VerdictWith("explained", axes), "unexplained");
}

TEST(LogFaults, AnotherFaultIsNotClean) {
  const LogFault stuck{"stuck", false, "stuck: mocap.csv stands still"};
  EXPECT_EQ(VerdictWith("clean", stuck), "unexplained");
  EXPECT_EQ(VerdictWith("explained", stuck), "explained");
}

TEST(LogFaults, WhatTheCatalogueStatesIsJudgedByTheSearch) {
  const LogFault scale{"accelerometer_scale", false, "accelerometer_scale: 0.9"};
  EXPECT_EQ(VerdictWith("clean", scale), "clean");
  EXPECT_EQ(VerdictWith("ambiguous", scale), "ambiguous");
}

TEST(LogFaults, NoneLeaveTheVerdict) {
  Diagnosis diagnosis;
  diagnosis.verdict = "clean";
  AddLogFaults({}, &diagnosis);
  EXPECT_EQ(diagnosis.verdict, "clean");
}

}  // namespace
}  // namespace trueline
