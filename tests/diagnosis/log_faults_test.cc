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
  const LogFault axes{"accelerometer_axes", "", 0.0, true,
                      "accelerometer_axes: x and y are exchanged"};
  EXPECT_EQ(VerdictWith("clean", axes), "unexplained");
  EXPECT_EQ(VerdictWith("explained", axes), "unexplained");
}

TEST(LogFaults, AFatalFaultLeavesNoEffectInTheModel) {
  Diagnosis diagnosis;
  diagnosis.in_model = {Effect{}};
  diagnosis.open.described.resize(1);
  diagnosis.open.described[0].in_model = true;
  AddLogFaults({{"stuck", "", 0.0, false, "stuck"}}, &diagnosis);
  EXPECT_EQ(diagnosis.in_model.size(), 1U);
  AddLogFaults({{"accelerometer_axes", "", 0.0, true, "accelerometer_axes"}}, &diagnosis);
  EXPECT_TRUE(diagnosis.in_model.empty());
  EXPECT_FALSE(diagnosis.open.described[0].in_model);
  EXPECT_THAT(diagnosis.model_lacks, testing::HasSubstr("fatal"));
}

TEST(LogFaults, AnotherFaultIsNotClean) {
  const LogFault stuck{"stuck", "", 0.0, false, "stuck: mocap.csv stands still"};
  EXPECT_EQ(VerdictWith("clean", stuck), "unexplained");
  EXPECT_EQ(VerdictWith("explained", stuck), "explained");
}

TEST(LogFaults, WhatTheCatalogueStatesIsJudgedByTheSearch) {
  const LogFault scale{"accelerometer_scale", "", 0.0, false, "accelerometer_scale: 0.9"};
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
