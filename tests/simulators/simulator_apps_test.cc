// trueline-export and trueline-audit as a user runs them: exit codes, messages, result files.
#include <yaml-cpp/yaml.h>

#include "tests/common/run_program.h"

namespace trueline {
namespace {

class SimulatorApps : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* verb : {"audit", "export"}) {
      if (!std::filesystem::exists(App(verb))) GTEST_SKIP() << verb << " is not built";
    }
    // What a calibration of the rotor drive writes.
    std::ofstream(folder_ / "model.yaml") << R"(parameters:
  I_x: {value: 0.00062, sigma: 0.00001, unit: kg m^2, status: identified}
  k_f: {value: 1.02, sigma: 0.01, unit: 1, status: identified}
  K_x: {value: -0.3, sigma: 0.01, unit: 1/s, status: identified}
effects: [{id: rotor_speed_drag, k: 0.0001}, {id: thrust_sag, d: 0.001}]
provenance:
  config:
    prior: {m: {mean: 0.25, sigma: 0}, I_y: {mean: 0.00068, sigma: 0}, I_z: {mean: 0.0011, sigma: 0},
            k_m: {mean: 1, sigma: 0}, motor_lag: {mean: 0.03, sigma: 0}}
    motors: {full_speed: 2200}
    rotors:
      - {position: [0.071, 0.08, 0], spin: -1, k_f: 3.8e-7, k_m: 3.6e-9}
      - {position: [-0.071, -0.08, 0], spin: -1, k_f: 3.8e-7, k_m: 3.6e-9}
      - {position: [0.071, -0.08, 0], spin: 1, k_f: 3.8e-7, k_m: 3.6e-9}
      - {position: [-0.071, 0.08, 0], spin: 1, k_f: 3.8e-7, k_m: 3.6e-9}
)";
  }
  Outcome Run(const std::string& verb, const std::string& arguments) const {
    return RunShell(fmt::format("cd '{}' && '{}' {}", folder_.directory().string(),
                                App(verb).string(), arguments));
  }

  TestFolder folder_;
};

TEST_F(SimulatorApps, ExportWritesTheFileAndWhatIsLost) {
  ASSERT_THAT(Run("export", "--model=model.yaml --to=gz --out=v.sdf"),
              Ends(0, HasSubstr("thrust_sag")));
  EXPECT_THAT(ReadText(folder_ / "v.sdf"), HasSubstr("<motorConstant>3.876e-07</motorConstant>"));
  const YAML::Node lost = YAML::LoadFile((folder_ / "v.sdf.lost.yaml").string());
  EXPECT_EQ(lost["target"].as<std::string>(), "gz");
  EXPECT_GE(lost["lost"].size(), 2U);
  const Outcome listed = Run("export", "--to=list");
  EXPECT_EQ(listed.exit_code, 0);
  EXPECT_THAT(listed.out, HasSubstr("crazyflow"));
}

TEST_F(SimulatorApps, ExportRefusesBadInput) {
  EXPECT_THAT(Run("export", "--model=model.yaml --to=unreal --out=v"), Refuses("px4_sih"));
  EXPECT_EQ(Run("export", "--model=none.yaml --to=gz --out=v").exit_code, 2);
  EXPECT_EQ(Run("export", "--to=gz").exit_code, 2);
  std::ofstream(folder_ / "imu.yaml")
      << "parameters: {K_x: {value: -0.3}}\nprovenance: {config: {}}\n";
  EXPECT_THAT(Run("export", "--model=imu.yaml --to=gz --out=v"), Refuses("--drive=rotors"));
  EXPECT_THAT(Run("export", "--model=. --to=gz --out=v"), Refuses("give the model.yaml in it"));
}

TEST_F(SimulatorApps, ExportWarnsOfABodyThatCannotBe) {
  std::string text = ReadText(folder_ / "model.yaml");
  text.replace(text.find("I_z: {mean: 0.0011"), 18, "I_z: {mean: 0.0031");
  std::ofstream(folder_ / "model.yaml") << text;
  EXPECT_THAT(Run("export", "--model=model.yaml --to=gz --out=v.sdf"),
              Ends(0, HasSubstr("no body has this inertia: I_z")));
}

TEST_F(SimulatorApps, AuditOfAFileAlone) {
  ASSERT_EQ(Run("export", "--model=model.yaml --to=rotorpy --out=v.yaml").exit_code, 0);
  EXPECT_EQ(
      Run("audit", "--simulator=v.yaml --out=a --report=false --fail_on=contradicted").exit_code,
      0);
  std::string text = ReadText(folder_ / "v.yaml");
  text.replace(text.find("tau_m: 0.03"), 11, "tau_m: 0.003");
  std::ofstream(folder_ / "v.yaml") << text;
  EXPECT_EQ(Run("audit", "--simulator=v.yaml --out=a --report=false").exit_code, 0);
  EXPECT_EQ(
      Run("audit", "--simulator=v.yaml --out=a --report=false --fail_on=contradicted").exit_code,
      4);
  const YAML::Node audit = YAML::LoadFile((folder_ / "a/audit.yaml").string());
  ASSERT_EQ(audit["contradicted"].size(), 1U);
  EXPECT_EQ(audit["contradicted"][0]["parameter"].as<std::string>(), "tau");
  EXPECT_GT(audit["contradicted"][0]["place"]["line"].as<int>(), 0);
  EXPECT_EQ(audit["contradicted"][0]["place"]["key"].as<std::string>(), "tau_m");
}

TEST_F(SimulatorApps, AuditRefusesBadInput) {
  EXPECT_EQ(Run("audit", "--simulator=none.sdf --out=a").exit_code, 2);
  std::ofstream(folder_ / "p.sdf") << "<sdf><model><link name='a'><inertial>\n<mass>0.02*2</mass>"
                                      "</inertial></link></model></sdf>";
  EXPECT_THAT(Run("audit", "--simulator=p.sdf --out=a"),
              Ends(2, AllOf(HasSubstr("p.sdf:2"), HasSubstr("'mass'"), HasSubstr("0.04"))));
  std::ofstream(folder_ / "other.yaml") << "a: 1\n";
  EXPECT_THAT(Run("audit", "--simulator=other.yaml --out=a"), Refuses("rotorpy"));
  ASSERT_EQ(Run("export", "--model=model.yaml --to=rotorpy --out=v.yaml").exit_code, 0);
  EXPECT_THAT(Run("audit", "--simulator=v.yaml --vehicle=nix --out=a"),
              Refuses("names no vehicle"));
  EXPECT_EQ(Run("audit", "--out=a").exit_code, 2);
  EXPECT_EQ(Run("audit", "--simulator=p.sdf --out=a --fail_on=warning").exit_code, 2);
  EXPECT_EQ(Run("audit", "--simulator_log=a --out=a").exit_code, 2);
}

}  // namespace
}  // namespace trueline
