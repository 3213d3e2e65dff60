// Terms of the open catalogue: symbols, words and units, and what the models compute of them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/effects/declaration.h"
#include "problems/effects/effect.h"
#include "problems/simulation/forces.h"
#include "problems/vgd/term_series.h"
#include "tests/common/test_files.h"

namespace trueline {
namespace {

const std::vector<std::string>& AllSymbols() {
  static const std::vector<std::string> symbols = {"v_x",
                                                   "v_y*v_y",
                                                   "v_z*p",
                                                   "q*v_x",
                                                   "abs(r)",
                                                   "T(9.81)",
                                                   "sin(psi)",
                                                   "cos(2*psi)",
                                                   "x(3.5)",
                                                   "y*h(2)",
                                                   "t(50;40)",
                                                   "place(8,2;2.5)",
                                                   "place(8,2;2.5;4)",
                                                   "slope_north(8,2;2.5)",
                                                   "slope_east(8,2;2.5)",
                                                   "lag(q;0.3)",
                                                   "abs(lag(T(9.81);1))"};
  return symbols;
}

TEST(Term, SymbolsAreReadAsTheyAreWritten) {
  for (const std::string& symbols : AllSymbols()) {
    EXPECT_EQ(SymbolsOf(ParseTerm("force_x", symbols).with), symbols);
  }
  for (const char* where :
       {"force_z", "force_east", "moment_y", "attitude_yaw", "fix_north", "fix_gate"}) {
    EXPECT_EQ(ParseTerm(where, "v_x").Where(), where);
  }
  EXPECT_EQ(SymbolsOf(ParseTerm("fix_gate", "d*d").with), "d*d");
  std::string nested = "v_x";
  for (int i = 0; i < 20000; ++i) nested = "abs(" + nested + ")";
  EXPECT_THROW(ParseTerm("force_x", nested), TermError);
  EXPECT_THROW(ParseTerm("force_x", "d"), TermError);  // no model of the vehicle has gates
}

TEST(Term, OfTheDistanceToTheGateIsUndoneInTheFixes) {
  FlightLog log;
  log.gravity = 9.81;
  log.gates.push_back({1, {4.0, 3.0, -1.0}, 0.0});
  for (int k = 0; k < 3; ++k) {
    const TimeNs t = FromSeconds(0.1 * k);
    log.imu.push_back({t, {0.0, 0.0, -9.81}, Eigen::Vector3d::Zero()});
    log.attitude.push_back(
        {t, Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()))});
  }
  // The vehicle is 5 m from the gate, so that fixes err by 0.02 * 25 m along the line to it.
  log.fixes.push_back({FromSeconds(0.1), {0.4, 0.3, -1.0}, 0.1, 1});
  const Effect effect{
      "term", {{"size", 0.02}}, std::make_shared<TermForm>(ParseTerm("fix_gate", "d*d"))};
  const std::vector<VelocitySample> path = {
      {0, Eigen::Vector3d::Zero(), {0.0, 0.0, -1.0}},
      {FromSeconds(0.2), Eigen::Vector3d::Zero(), {0.0, 0.0, -1.0}}};
  const FlightLog corrected = CorrectLog(log, {effect}, path);
  EXPECT_LT((corrected.fixes.front().p_E - Eigen::Vector3d(0.0, 0.0, -1.0)).norm(), 1e-9);
}

TEST(Term, WordsHaveUnits) {
  EXPECT_EQ(ParseTerm("force_x", "q").Text(1.5, 0.2),
            "a force along x_B of 1.5 +- 0.2 m/s^2 for each rad/s of pitch rate");
  EXPECT_EQ(ParseTerm("force_east", "place(8,2;2)").Text(2.0, 0.1),
            "a force along east of 2 +- 0.1 m/s^2 while within about 2.0 m of (8.0, 2.0)");
  EXPECT_EQ(
      ParseTerm("moment_y", "lag(q;0.3)").Text(2.0, 0.1),
      "an angular acceleration about y_B of 2 +- 0.1 rad/s^2 for each rad/s of pitch rate 0.3 s "
      "earlier");
  EXPECT_EQ(ParseTerm("attitude_pitch", "lag(q;0.1)").Text(-0.035, 0.004),
            "the logged pitch is wrong by -0.035 +- 0.004 rad for each rad/s of pitch rate 0.1 s "
            "earlier");
  EXPECT_EQ(ParseTerm("attitude_yaw", "sin(psi)").Text(0.1, 0.02),
            "the logged heading is wrong by 0.1 +- 0.02 rad times the sine of the heading");
  EXPECT_EQ(ParseTerm("fix_north", "v_x").Text(0.1, 0.02),
            "the fixes are off along north by 0.1 +- 0.02 m for each m/s of forward speed");
  EXPECT_EQ(ParseTerm("fix_north", "v_x*v_x").Unit(), "m for each (m/s)^2");
  EXPECT_EQ(ParseTerm("fix_gate", "d*d").Text(0.06, 0.01),
            "the fixes are off along the line to the gate by 0.06 +- 0.01 m for each (m)^2 of the "
            "square of the distance to the gate");
}

// At 45 deg of heading, moving and turning about all axes.
TermState<double> SomeState() {
  TermState<double> state;
  state.R_E_B = (Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitZ()) *
                 Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()))
                    .toRotationMatrix();
  state.v_B = {4.0, -1.0, 0.5};
  state.w_B = {0.3, -0.7, 1.1};
  state.thrust = 11.0;
  state.p_E = {7.0, 3.0, -5.0};
  state.t = 33.0;
  return state;
}

// The simulator's own formulas, for which the model's are checked.
TEST(Term, TheModelsComputeWhatTheSimulatorFlies) {
  const TermState<double> state = SomeState();
  const simulation::Flow flow{state.t,   state.v_B, state.thrust, 0.0,        5.0,
                              state.v_B, state.w_B, state.p_E,    state.R_E_B};
  for (const char* where : {"force_x", "force_y", "force_east", "moment_z"}) {
    for (const std::string& symbols : AllSymbols()) {
      if (symbols.find("lag") != std::string::npos) continue;
      Effect effect{"term", {{"size", 0.7}}};
      effect.term = std::make_shared<TermForm>(ParseTerm(where, symbols));
      simulation::Stages stages;
      simulation::AddTerm(effect, &stages);
      Eigen::Vector3d force = Eigen::Vector3d::Zero(), turn = force;
      simulation::Apply(stages.force, flow, &force);
      simulation::Apply(stages.turn, flow, &turn);
      const Eigen::Vector3d model = effect.term->Sized(0.7).InBody(state);
      EXPECT_LT((force + turn - model).norm(), 1e-9) << where << " with " << symbols;
      EXPECT_EQ(turn.isZero(0.0), effect.term->on == TermOn::kForce) << where;
    }
  }
}

// A turn that starts at 1 s: after one time constant the lag shows 63 % of it.
TEST(Term, WhatLagsFollowsTheLog) {
  FlightLog log;
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.004 * k;
    log.imu.push_back({FromSeconds(t), {0.0, 0.0, -9.81}, {0.0, t < 1.0 ? 0.0 : 2.0, 0.0}});
  }
  TermForm term = ParseTerm("force_x", "lag(q;0.3)");
  BindTerms(log, &term.with);
  TermState<double> state;
  state.t = 0.9;
  EXPECT_NEAR(term.At(state).x(), 0.0, 1e-12);
  state.t = 1.3;
  EXPECT_NEAR(term.At(state).x(), 2.0 * (1.0 - std::exp(-1.0)), 0.06);
  TermForm voltage = ParseTerm("force_x", "U(15)");
  EXPECT_THAT(ErrorOf([&] { BindTerms(log, &voltage.with); }), HasSubstr("battery.csv"));
}

std::string ModelError(const std::string& entry, DriveKind drive = DriveKind::kImu) {
  return ErrorOf(
      [&] { ReadEffects(YamlMap(YAML::Load("effects:\n  - " + entry), "model.yaml", ""), drive); });
}

TEST(Term, AModelRefusesWhatItDoesNotKnow) {
  const std::string good =
      "{id: term, where: force_x, with: q, size: 0.3, unit: m/s^2 for each rad/s}";
  EXPECT_EQ(ModelError(good), "no error");
  const std::string unknown =
      ModelError("{id: term, where: force_x, with: v_q, size: 0.3, unit: m/s^2}");
  EXPECT_THAT(unknown, HasSubstr("model.yaml:2"));
  EXPECT_THAT(unknown, HasSubstr("'v_q' is not known"));
  EXPECT_THAT(unknown, HasSubstr("lag(q;0.3)"));
  EXPECT_THAT(ModelError("{id: term, where: force_q, with: q, size: 0.3, unit: m/s^2}"),
              HasSubstr("must be one of force_x"));
  EXPECT_THAT(ModelError("{id: term, where: force_x, with: q, size: 0.3, unit: rad}"),
              HasSubstr("it is 'm/s^2 for each rad/s'"));
  EXPECT_THAT(ModelError("{id: term, where: force_x, with: lag(v_x;1), size: 0.3, unit: m}"),
              HasSubstr("may lag"));
  EXPECT_THAT(ModelError("{id: term, where: force_x, with: place(1,2), size: 0.3, unit: m}"),
              HasSubstr("is not known"));
  EXPECT_THAT(
      ModelError("{id: term, where: moment_x, with: q, size: 1, unit: rad/s^2 for each rad/s}"),
      HasSubstr("does not enter the model that the IMU drives"));
  EXPECT_THAT(ModelError("{id: term, where: fix_x, with: q, size: 1, unit: m for each rad/s}",
                         DriveKind::kRotors),
              HasSubstr("does not enter the model that rotor speeds drive"));
}

TEST(Term, AModelFileHoldsAllOfIt) {
  Effect effect{"term", {{"size", -0.31}, {"sigma", 0.042}}};
  effect.term = std::make_shared<TermForm>(ParseTerm("force_y", "abs(p)*v_x"));
  YAML::Node model;
  model["effects"].push_back(ToYaml(effect));
  const auto read = ReadEffects(YamlMap(YAML::Load(YAML::Dump(model)), "model.yaml", ""));
  ASSERT_EQ(read.size(), 1u);
  EXPECT_EQ(read[0].term->Name(), effect.term->Name());
  EXPECT_EQ(read[0].values, effect.values);
}

}  // namespace
}  // namespace trueline
