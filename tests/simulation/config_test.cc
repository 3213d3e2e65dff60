// Configurations: those that ship run, those that are wrong are refused with file, line and remedy.
#include "problems/simulation/config.h"

#include <gmock/gmock.h>

#include "problems/common/error.h"
#include "problems/simulation/simulate.h"
#include "tests/common/test_files.h"
#include "tests/simulation/short_flight.h"

namespace trueline::testing_simulation {
namespace {

const std::string kCourse =
    "course:\n"
    "  radius: 1.5\n"
    "  corners: [{position: [4.5, 0], gate: 0}, {position: [4.5, 3]}, {position: [-1.5, 3]},\n"
    "            {position: [-1.5, 0]}]\n";

SimulationConfig Parse(const std::string& text) {
  return ReadSimulationConfig(YamlMap(YAML::Load(text), "flight.yaml", ""));
}

std::string ErrorOf(const std::string& text) {
  return trueline::ErrorOf([&] { Parse(text); });
}

TEST(Config, EveryShippedCourseFlies) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(ConfigFolder())) {
    SCOPED_TRACE(entry.path().string());
    SimulationConfig config = ReadSimulationConfig(YamlMap::FromFile(entry.path()));
    config.duration = 20.0;
    const Flown flown = Fly(DrawVariant(config, 4), 4);
    EXPECT_GT(flown.log.fixes.size(), 10U);
    EXPECT_LT(flown.truth.path_error_max, 0.3);
    ++count;
  }
  EXPECT_GE(count, 5);
}

TEST(Config, DefaultsFlyTheCourse) {
  SimulationConfig config = Parse(kCourse + "duration: 5\nwarm_up: 1\n");
  EXPECT_EQ(config.vehicle.rotors.size(), 4U);
  EXPECT_GT(Simulate(config, 1).fixes.size(), 5U);
}

TEST(Config, UnknownEffectIsRefusedWithLineAndChoices) {
  EXPECT_THAT(
      ErrorOf(kCourse + "effects:\n  - {id: cubic_drag, c: 1}\n"),
      AllOf(HasSubstr("flight.yaml:6"), HasSubstr("cubic_drag"), HasSubstr("quadratic_drag")));
}

TEST(Config, MissingAndUnknownEffectParametersAreRefused) {
  EXPECT_THAT(ErrorOf(kCourse + "effects:\n  - {id: wind, w_x: 1}\n"), HasSubstr("w_y"));
  EXPECT_THAT(ErrorOf(kCourse + "effects:\n  - {id: fix_scale, s: 0.1, t: 2}\n"),
              AllOf(HasSubstr("flight.yaml:6"), HasSubstr("'effects[0].t': unknown key")));
}

TEST(Config, UnknownKeysAndBadValuesAreRefused) {
  EXPECT_THAT(ErrorOf(kCourse + "imu:\n  rat: 512\n"),
              AllOf(HasSubstr("flight.yaml:6"), HasSubstr("imu.rat")));
  EXPECT_THAT(ErrorOf(kCourse + "duration: -1\n"),
              HasSubstr("must be above zero and finite, found -1"));
  EXPECT_THAT(ErrorOf(kCourse + "duration: 1e6\n"), HasSubstr("must be at most 100000 s"));
  EXPECT_THAT(ErrorOf(kCourse + "ahrs: {kind: magic}\n"), HasSubstr("complementary_filter"));
  EXPECT_THAT(ErrorOf(kCourse + "randomise: {K_w: [0, 1]}\n"), HasSubstr("K_x"));
}

TEST(Config, ALagTooShortForTheIntegrationIsRefused) {
  const SimulationConfig config =
      Parse(kCourse + "imu: {rate: 100}\nvehicle: {motor_lag: 0.003}\n");
  EXPECT_THAT(trueline::ErrorOf([&] { Simulate(config, 1); }), HasSubstr("a motor lag of 0.003 s"));
}

TEST(Config, CoursesThatCannotBeFlownAreRefused) {
  EXPECT_THAT(ErrorOf("course: {radius: 2, corners: [{position: [2, 0]}, {position: [2, 2]},"
                      " {position: [0, 2]}, {position: [0, 0]}]}\n"),
              HasSubstr("make the radius smaller"));
  EXPECT_THAT(ErrorOf("course: {radius: 1, corners: [{position: [2, 0]}]}\n"),
              HasSubstr("at least 3"));
}

TEST(Config, EffectsThatWouldChangeNothingAreRefused) {
  const auto error = [](const std::string& effect) {
    return ErrorOf(kCourse + "effects:\n  - " + effect + "\n");
  };
  const std::string moved = "dx: 1, dy: 0, dz: 0}";
  EXPECT_THAT(error("{id: gate_moved, gate: 99, " + moved),
              AllOf(HasSubstr("flight.yaml:6"), HasSubstr("gate 99 is none of this flight")));
  EXPECT_THAT(error("{id: false_gate, fraction: 0.2, gate: 99}"), HasSubstr("gate 99"));
  EXPECT_THAT(error("{id: false_gate, fraction: 3}"), HasSubstr("fraction 3 is no share"));
  EXPECT_THAT(error("{id: false_gate, fraction: -1}"), HasSubstr("fraction -1"));
  EXPECT_THAT(error("{id: rotor_loss, rotor: 9, factor: 0.9}"),
              HasSubstr("use one of: 0, 1, 2, 3"));
  EXPECT_THAT(error("{id: rotor_loss, rotor: 1.7, factor: 0.9}"), HasSubstr("rotor 1.7"));
  EXPECT_THAT(ErrorOf(kCourse + "gnss: {rate: 5}\neffects: [{id: fix_scale, s: 0.1}]\n"),
              HasSubstr("here is none"));
  EXPECT_THAT(ErrorOf(kCourse + "gnss: {rate: 5}\ndetector: {sigma_factor: 0.1}\n"),
              HasSubstr("'detector'"));
}

TEST(Variant, DrawsWithinTheRangesAndBySeed) {
  const SimulationConfig config = ReadShipped("hippodrome");
  const SimulationConfig a = DrawVariant(config, 1), b = DrawVariant(config, 2);
  EXPECT_NE(a.vehicle.drag.x(), b.vehicle.drag.x());
  EXPECT_EQ(a.vehicle.drag.x(), DrawVariant(config, 1).vehicle.drag.x());
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const double K_x = DrawVariant(config, seed).vehicle.drag.x();
    EXPECT_TRUE(K_x >= -0.8 && K_x <= -0.3) << K_x;
  }
  EXPECT_EQ(a.vehicle.drag.z(), config.vehicle.drag.z());
}

TEST(Variant, RefusesWhatWouldChangeNothingOrMeansNothing) {
  const auto error = [](const std::string& file, const std::string& name, double value) {
    SimulationConfig config = ReadShipped(file);
    config.randomise = {{name, {value, value}}};
    return trueline::ErrorOf([&] { DrawVariant(config, 1); });
  };
  EXPECT_THAT(error("hippodrome", "phi_E_Ep", 0.2), HasSubstr("outcome of the complementary"));
  EXPECT_THAT(error("hippodrome_exact", "heading_error", 0.2), HasSubstr("of another kind"));
  EXPECT_THAT(error("hippodrome", "tilt_gain", -5.0), HasSubstr("above zero"));
  EXPECT_THAT(error("hippodrome", "turbulence_memory", -5.0), HasSubstr("zero or above"));
  SimulationConfig config = ReadShipped(
      "hippodrome", 0.0,
      {{"false_gate", {{"fraction", 0.1}, {"gate", -1}, {"dx", 0}, {"dy", 1}, {"dz", 0}}}});
  config.randomise = {{"false_gate.fraction", {3.0, 3.0}}};
  EXPECT_THAT(trueline::ErrorOf([&] { DrawVariant(config, 1); }), HasSubstr("no share"));
}

TEST(Truth, StatesParametersEffectsAndSeedBesideTheLog) {
  const Flown flown = FlyWith("wind", {{"w_x", 0.5}, {"w_y", 0.0}});
  const YAML::Node truth = YAML::Load(TruthYaml(flown.truth, "a.yaml"));
  EXPECT_EQ(truth["parameters"]["K_x"]["value"].as<double>(), -0.5);
  EXPECT_NEAR(truth["parameters"]["psi_E_Ep"]["value"].as<double>(), 0.020, 1e-9);
  EXPECT_TRUE(truth["parameters"]["psi_E_Ep"]["constant"].as<bool>());
  EXPECT_EQ(truth["effects"][0]["id"].as<std::string>(), "wind");
  EXPECT_EQ(truth["effects"][0]["w_x"].as<double>(), 0.5);
  EXPECT_EQ(truth["seed"].as<int>(), 1);
  EXPECT_EQ(TruthPath("/tmp/a/"), "/tmp/a.truth.yaml");
  EXPECT_EQ(TruthPath("a/b"), "a/b.truth.yaml");
}

}  // namespace
}  // namespace trueline::testing_simulation
