// Effects are declared once; the simulator has physics of its own for each of them.
#include "problems/effects/declaration.h"

#include <set>

#include "problems/common/error.h"
#include "problems/simulation/effects.h"
#include "tests/common/test_files.h"

namespace trueline {
namespace {

std::string EntryOf(const EffectInfo& info, const std::string& misspelt = "") {
  std::string entry = "effects: [{id: " + info.id;
  for (const std::string& name : info.ParameterNames()) {
    entry += ", " + (name == misspelt ? "not_" + name : name) + ": 1";
  }
  return entry + "}]";
}

std::vector<Effect> Read(const std::string& yaml, DriveKind drive) {
  return ReadEffects(YamlMap(YAML::Load(yaml), "model.yaml", ""), drive);
}

class Declared : public testing::TestWithParam<DriveKind> {};

TEST_P(Declared, CausesHaveAllThatAUserReads) {
  std::set<std::string> ids;
  for (const EffectInfo* info : CausesOf(GetParam())) {
    EXPECT_TRUE(ids.insert(info->id).second) << info->id;
    EXPECT_FALSE(info->parameters.empty()) << info->id;
    EXPECT_FALSE(info->physics.empty()) << info->id;
    EXPECT_FALSE(info->definition.empty()) << info->id;
    EXPECT_FALSE(info->separate_by.empty()) << info->id;
    EXPECT_EQ(FindDeclared(info->id), info);
  }
}

TEST_P(Declared, TheSimulatorFliesEachWithTheSameParametersAndUnits) {
  using Parameters = std::set<std::pair<std::string, std::string>>;
  for (const EffectInfo* info : CausesOf(GetParam())) {
    const simulation::EffectDefinition* flown = simulation::FindEffect(info->id);
    ASSERT_NE(flown, nullptr) << info->id;
    Parameters declared, simulated;
    for (const auto& index : info->indices) declared.insert({index.name, index.unit});
    for (const auto& parameter : info->parameters)
      declared.insert({parameter.name, parameter.unit});
    for (const auto& parameter : flown->parameters)
      simulated.insert({parameter.name, parameter.unit});
    EXPECT_EQ(declared, simulated) << info->id;
  }
}

TEST_P(Declared, AModelTakesEachAndRefusesAMisspeltParameter) {
  for (const EffectInfo& info : DeclaredEffects(GetParam())) {
    ASSERT_EQ(Read(EntryOf(info), GetParam()).size(), 1u) << info.id;
    for (const std::string& name : info.ParameterNames()) {
      EXPECT_THAT(ErrorOf([&] { Read(EntryOf(info, name), GetParam()); }), HasSubstr("not_" + name))
          << info.id;
    }
  }
}

// What estimators do about an effect is declared with it; the robust loss copes with false fixes.
TEST_P(Declared, EstimatorsActOnEach) {
  for (const EffectInfo& info : DeclaredEffects(GetParam())) {
    const int ways =
        (info.add_force != nullptr) + (info.correct != nullptr) + (info.extend != nullptr);
    EXPECT_EQ(ways, info.id == "false_gate" ? 0 : 1) << info.id;
    EXPECT_EQ(info.extend != nullptr, GetParam() == DriveKind::kRotors) << info.id;
  }
}

// The blind sets hide only parameters that the effect has, at plausible sizes.
TEST_P(Declared, DrawnSizesAreThoseOfParameters) {
  for (const EffectInfo& info : DeclaredEffects(GetParam())) {
    const std::vector<std::string> names = info.ParameterNames();
    for (const DrawnSize& size : info.drawn) {
      EXPECT_THAT(names, Contains(size.name)) << info.id;
      EXPECT_GE(size.high, size.low) << info.id;
    }
    for (const EffectParameterInfo& parameter : info.parameters) {
      for (const DrawnSize& size : info.drawn) {
        if (size.name != parameter.name) continue;
        EXPECT_LT(std::max(std::abs(size.low), std::abs(size.high)), parameter.plausible);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Drives, Declared, testing::Values(DriveKind::kImu, DriveKind::kRotors),
                         [](const testing::TestParamInfo<DriveKind>& info) {
                           return info.param == DriveKind::kImu ? "imu" : "rotors";
                         });

// The id of a gate has more digits than a size.
TEST(EffectsInYaml, IndicesAreExact) {
  const Effect moved{"gate_moved", {{"gate", 7654321.0}, {"dx", 0.123456789}}};
  const YAML::Node node = ToYaml(moved);
  EXPECT_EQ(node["gate"].Scalar(), "7654321");
  EXPECT_EQ(node["dx"].Scalar(), "0.123457");
}

}  // namespace
}  // namespace trueline
