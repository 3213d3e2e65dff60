// Every effect that is declared for the IMU-driven model, through `--model` of the executables.
#include <array>
#include <cstdio>
#include <filesystem>
#include <string>

#include "cost_functions/models/imu_driven_model.h"
#include "problems/effects/declaration.h"
#include "tests/apps/calibrate_app.h"
#include "tests/common/matchers.h"

namespace trueline {
namespace {

class ModelEffects : public CalibrateApp {
 protected:
  // Writes a model with these effects at a step's size each; `misspelt`: a parameter's name that is
  // wrong in the first of them.
  void WriteModel(const std::vector<EffectInfo>& effects, const std::string& misspelt = "") const {
    std::ofstream file(root_ / "model.yaml");
    file << "parameters:\n";
    for (int i = 0; i < kMotionSize; ++i) {
      file << "  " << kTheta[i].name << ": {value: " << (IsDrag(i) ? -0.3 : 0.0)
           << ", sigma: 0.03, unit: " << kTheta[i].unit << "}\n";
    }
    file << "effects:\n";
    for (const EffectInfo& info : effects) {
      file << "  - {id: " << info.id;
      for (const EffectIndexInfo& index : info.indices) file << ", " << index.name << ": 1";
      for (const EffectParameterInfo& p : info.parameters) {
        file << ", " << (p.name == misspelt ? "not_" : "") << p.name << ": " << p.step;
      }
      file << "}\n";
    }
  }

  // The same with a term of the open catalogue.
  void WriteModelWithTerm(const std::string& with, const std::string& unit) const {
    WriteModel({});
    std::ofstream file(root_ / "model.yaml", std::ios::app);
    file << "  - {id: term, where: force_x, with: " << with << ", size: 0.1, unit: " << unit
         << "}\n";
  }

  static std::vector<EffectInfo> Causes() {
    std::vector<EffectInfo> causes;
    for (const EffectInfo* info : CausesOf(DriveKind::kImu)) causes.push_back(*info);
    return causes;
  }

  static bool IsDrag(int i) { return kTheta[i].group == ParameterGroup::kDrag; }

  Outcome RunVerb(const std::string& verb, const std::string& flags) const {
    return RunProgram(program_.parent_path() / ("trueline-" + verb),
                      fmt::format("--model='{}' --out='{}' --quiet {}",
                                  (root_ / "model.yaml").string(), (root_ / verb).string(), flags));
  }

  std::string Simulated() const {
    return fmt::format("--config='{}' --duration=4",
                       (testing_simulation::ConfigFolder() / "hippodrome.yaml").string());
  }
  std::string Logged() const {
    return fmt::format("--log='{}' --report=false", (root_ / "log").string());
  }
};

TEST_F(ModelEffects, SlowAllAreFlownCalibratedWithAndDiagnosedBeside) {
  WriteModel(Causes());
  const Outcome flown = RunVerb("simulate", Simulated());
  EXPECT_EQ(flown.exit_code, 0) << flown.err;
  const Outcome calibrated = RunVerb("calibrate", Logged() + " --gamma_sweep=");
  EXPECT_EQ(calibrated.exit_code, 0) << calibrated.err;
  const Outcome diagnosed = RunVerb("diagnose", Logged());
  EXPECT_EQ(diagnosed.exit_code, 0) << diagnosed.err;
}

TEST_F(ModelEffects, SlowAMisspeltParameterOfEachIsRefused) {
  for (const EffectInfo& info : Causes()) {
    WriteModel({info}, info.parameters.front().name);
    for (const auto& [verb, flags] : {std::pair{"simulate", Simulated()},
                                      {"diagnose", Logged()},
                                      {"calibrate", Logged() + " --gamma_sweep="}}) {
      const Outcome refused = RunVerb(verb, flags);
      EXPECT_EQ(refused.exit_code, 2) << verb << " " << info.id;
      EXPECT_THAT(refused.err, HasSubstr(info.parameters.front().name)) << verb;
    }
  }
}

TEST_F(ModelEffects, SlowATermIsFlownCalibratedWithAndDiagnosedBeside) {
  WriteModelWithTerm("lag(q;0.3)", "m/s^2 for each rad/s");
  for (const auto& [verb, flags] : {std::pair{"simulate", Simulated()},
                                    {"diagnose", Logged()},
                                    {"calibrate", Logged() + " --gamma_sweep="}}) {
    const Outcome done = RunVerb(verb, flags);
    EXPECT_EQ(done.exit_code, 0) << verb << done.err;
  }
  const YAML::Node model = YAML::LoadFile(root_ / "calibrate/model.yaml");
  EXPECT_EQ(model["effects"][0]["with"].as<std::string>(), "lag(q;0.3)");
}

TEST_F(ModelEffects, SlowATermThatIsNotKnownIsRefused) {
  WriteModelWithTerm("pitch_rate", "m/s^2 for each rad/s");
  for (const auto& [verb, flags] : {std::pair{"simulate", Simulated()},
                                    {"diagnose", Logged()},
                                    {"calibrate", Logged() + " --gamma_sweep="}}) {
    const Outcome refused = RunVerb(verb, flags);
    EXPECT_EQ(refused.exit_code, 2) << verb;
    EXPECT_THAT(refused.err, HasSubstr("model.yaml:")) << verb;
    EXPECT_THAT(refused.err, HasSubstr("'pitch_rate' is not known")) << verb;
  }
}

// A rotor-driven flight states its effects in its configuration.
TEST_F(ModelEffects, SimulateRefusesAModelThatItWouldNotFly) {
  WriteModel({});
  const Outcome refused = RunVerb("simulate", fmt::format("--config='{}'", TRUELINE_TEST_SOURCE_DIR
                                                          "/config/rotors/random.yaml"));
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--model"));
}

// --- trueline-effects: what it lists.

TEST(EffectsApp, DescribesTheTermsOfTheOpenCatalogue) {
  const auto program = std::filesystem::path(TRUELINE_TEST_APPS_DIR) / "trueline-effects";
  if (!std::filesystem::exists(program)) GTEST_SKIP() << program << " is not built";
  std::FILE* pipe = popen((program.string() + " --id=term").c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string text;
  std::array<char, 256> line;
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) text += line.data();
  EXPECT_EQ(pclose(pipe), 0);
  EXPECT_THAT(text, testing::StartsWith("term: where, with, size"));
}

}  // namespace
}  // namespace trueline
