// Every effect that is declared for the IMU-driven model, through `--model` of the executables.
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
    return RunApp(verb,
                  fmt::format("--model='{}' --out='{}' --quiet {}", (root_ / "model.yaml").string(),
                              (root_ / verb).string(), flags));
  }

  std::string Simulated() const {
    return fmt::format("--config='{}' --duration=4",
                       (testing_simulation::ConfigFolder() / "hippodrome.yaml").string());
  }
  // Each that takes a model, with its other flags.
  std::vector<std::pair<std::string, std::string>> Verbs() const {
    const std::string logged = fmt::format("--log='{}' --report=false", (root_ / "log").string());
    return {
        {"simulate", Simulated()}, {"diagnose", logged}, {"calibrate", logged + " --gamma_sweep="}};
  }
};

TEST_F(ModelEffects, SlowAllAreFlownCalibratedWithAndDiagnosedBeside) {
  WriteModel(Causes());
  for (const auto& [verb, flags] : Verbs()) {
    const Outcome done = RunVerb(verb, flags);
    EXPECT_EQ(done.exit_code, 0) << verb << done.err;
  }
}

TEST_F(ModelEffects, SlowAMisspeltParameterOfEachIsRefused) {
  for (const EffectInfo& info : Causes()) {
    WriteModel({info}, info.parameters.front().name);
    for (const auto& [verb, flags] : Verbs()) {
      EXPECT_THAT(RunVerb(verb, flags), Refuses(info.parameters.front().name)) << verb << info.id;
    }
  }
}

TEST_F(ModelEffects, SlowATermIsFlownCalibratedWithAndDiagnosedBeside) {
  WriteModelWithTerm("lag(q;0.3)", "m/s^2 for each rad/s");
  for (const auto& [verb, flags] : Verbs()) {
    const Outcome done = RunVerb(verb, flags);
    EXPECT_EQ(done.exit_code, 0) << verb << done.err;
  }
  const YAML::Node model = YAML::LoadFile(root_ / "calibrate/model.yaml");
  EXPECT_EQ(model["effects"][0]["with"].as<std::string>(), "lag(q;0.3)");
}

TEST_F(ModelEffects, SlowATermThatIsNotKnownIsRefused) {
  WriteModelWithTerm("pitch_rate", "m/s^2 for each rad/s");
  for (const auto& [verb, flags] : Verbs()) {
    EXPECT_THAT(RunVerb(verb, flags),
                Ends(2, AllOf(HasSubstr("model.yaml:"), HasSubstr("'pitch_rate' is not known"))))
        << verb;
  }
}

// A rotor-driven flight states its effects in its configuration.
TEST_F(ModelEffects, SimulateRefusesAModelThatItWouldNotFly) {
  WriteModel({});
  EXPECT_THAT(RunVerb("simulate", fmt::format("--config='{}'", TRUELINE_TEST_SOURCE_DIR
                                              "/config/rotors/random.yaml")),
              Refuses("--model"));
}

// --- trueline-effects: what it lists.

TEST(EffectsApp, DescribesTheTermsOfTheOpenCatalogue) {
  if (!std::filesystem::exists(App("effects"))) GTEST_SKIP() << "it is not built";
  const Outcome listed = RunApp("effects", "--id=term");
  EXPECT_EQ(listed.exit_code, 0);
  EXPECT_THAT(listed.out, testing::StartsWith("term: where, with, size"));
}

}  // namespace
}  // namespace trueline
