// trueline-calibrate on good flights and flags: table, files, silence, help, models, the page.
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "tests/apps/calibrate_app.h"
#include "tests/common/matchers.h"

namespace trueline {
namespace {

TEST_F(CalibrateApp, PrintsTheTableAndWritesTheFiles) {
  const Outcome done = Calibrate();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr("mean [m]"), HasSubstr("K_x"), HasSubstr("verdict: ")));
  for (const char* file : {"calibration.yaml", "model.yaml", "arcs.csv", "trajectory.csv",
                           "windows.csv", "residuals.csv"}) {
    EXPECT_TRUE(std::filesystem::exists(root_ / "out" / file)) << file;
  }
  for (const auto& entry : std::filesystem::directory_iterator(root_ / "out")) {
    EXPECT_THAT(entry.path().filename().string(), Not(HasSubstr("tmp")));
  }
}

TEST_F(CalibrateApp, IsQuietWhereAsked) {
  const Outcome done = Run(fmt::format("--log='{}' --out='{}' --gamma_sweep= --quiet",
                                       (root_ / "log").string(), (root_ / "out").string()));
  EXPECT_EQ(done.exit_code, 0);
  EXPECT_THAT(done.out + done.err, IsEmpty());
}

TEST_F(CalibrateApp, TeachesByExample) {
  for (const char* flag : {"--help", "-help"}) {
    const Outcome help = Run(flag);
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_THAT(help.out,
                AllOf(HasSubstr("trueline calibrate --log=flight --out=result"),
                      HasSubstr("--gamma"), HasSubstr("Exit codes: 0 done, 2 bad input")));
  }
}

TEST_F(CalibrateApp, RefusesWrongFlags) {
  EXPECT_EQ(Run("--gama=3").exit_code, 2);
  EXPECT_EQ(Run("--gamma=three").exit_code, 2);
  EXPECT_THAT(Run(""), Refuses("--log and --out are needed"));
  EXPECT_THAT(Calibrate("flight"), Refuses("'flight' is not a flag"));
  EXPECT_THAT(Calibrate("--estimator=magic"),
              Refuses("estimator 'magic' is not known; use one of:"));
}

TEST_F(CalibrateApp, TakesALogWithoutAFlagAndPutsResultsBeside) {
  const auto here = std::filesystem::current_path();
  std::filesystem::current_path(root_);
  const Outcome done = Run("log --gamma_sweep= --report=false");
  const Outcome twice = Run("log --log=log");
  std::filesystem::current_path(here);
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("results: log-calibrate\n"));
  EXPECT_TRUE(std::filesystem::exists(root_ / "log-calibrate" / "calibration.yaml"));
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_THAT(twice.err, HasSubstr("'log' is not a flag;"));
}

TEST_F(CalibrateApp, RefusesAVerdictWhereAskedTo) {
  EXPECT_THAT(Calibrate("--fail_on=bad"),
              Refuses("--fail_on=bad is not known; use poor or unusable"));
  const Outcome done = Calibrate("--fail_on=poor");
  const bool usable = done.out.find("verdict: usable") != std::string::npos;
  EXPECT_EQ(done.exit_code, usable ? 0 : 4) << done.out;
  EXPECT_TRUE(std::filesystem::exists(root_ / "out" / "calibration.yaml"));
}

TEST(FailOn, RefusesWhatWasAskedForAndWorse) {
  const FailOn poor("poor", {"poor", "unusable"}), unusable("unusable", {"poor", "unusable"});
  EXPECT_EQ(poor.ExitFor("usable"), kExitDone);
  EXPECT_EQ(poor.ExitFor("poor"), kExitRefused);
  EXPECT_EQ(poor.ExitFor("unusable", kExitNoResult), kExitRefused);
  EXPECT_EQ(unusable.ExitFor("poor"), kExitDone);
  EXPECT_EQ(FailOn("", {"poor"}).ExitFor("poor", kExitNoResult), kExitNoResult);
  EXPECT_THROW(FailOn("usable", {"poor"}), InputError);
}

TEST_F(CalibrateApp, RefusesAnUnknownKeyInItsConfiguration) {
  std::ofstream(root_ / "config.yaml") << "gamma: 3\nhuber: true\n";
  EXPECT_THAT(Calibrate(fmt::format("--config='{}'", (root_ / "config.yaml").string())),
              Refuses("config.yaml:2: 'huber': unknown key"));
  EXPECT_EQ(Calibrate("--config=/nowhere.yaml").exit_code, 2);
}

TEST_F(CalibrateApp, FindsOutEarlyThatItCannotWrite) {
  std::ofstream(root_ / "out") << "a file, not a folder";
  const Outcome done = Calibrate();
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_THAT(done.err, AllOf(HasSubstr("out"), HasSubstr("cannot be written"),
                              HasSubstr("check that the folder exists, is writable")));
  EXPECT_THAT(done.out, IsEmpty());
  EXPECT_EQ(ReadText(root_ / "out"), "a file, not a folder");
}

TEST_F(CalibrateApp, TakesTheModelOfAnEarlierFlight) {
  ASSERT_EQ(Calibrate().exit_code, 0);
  const YAML::Node first = YAML::LoadFile(root_ / "out/model.yaml")["parameters"];
  const std::string model = (root_ / "earlier.yaml").string();
  std::filesystem::copy_file(root_ / "out/model.yaml", model);
  WriteNativeLog(Fly(4), root_ / "log");
  const Outcome done = Calibrate(fmt::format("--model='{}'", model));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const YAML::Node second = YAML::LoadFile(root_ / "out/model.yaml")["parameters"];
  EXPECT_LT(second["K_x"]["sigma"].as<double>(), first["K_x"]["sigma"].as<double>());
}

TEST_F(CalibrateApp, TheModelOfThisFlightIsNoPriorForIt) {
  ASSERT_EQ(Calibrate().exit_code, 0);
  const YAML::Node first = YAML::LoadFile(root_ / "out/model.yaml")["parameters"];
  const std::string model = (root_ / "earlier.yaml").string();
  std::filesystem::copy_file(root_ / "out/model.yaml", model);
  EXPECT_THAT(Calibrate(fmt::format("--model='{}'", model)),
              Ends(0, HasSubstr("fitted to this very flight")));
  const YAML::Node second = YAML::LoadFile(root_ / "out/model.yaml")["parameters"];
  EXPECT_EQ(second["K_x"]["sigma"].as<double>(), first["K_x"]["sigma"].as<double>());
}

// Else the diagnosis would count the same data twice: sigmas would shrink with each repetition.
TEST_F(CalibrateApp, TheModelOfThisFlightIsNoPriorForItsDiagnosis) {
  ASSERT_EQ(Calibrate().exit_code, 0);
  const auto diagnose = [&](const std::string& more) {
    return RunApp("diagnose",
                  fmt::format("--log='{}' --out='{}' --report=false {}", (root_ / "log").string(),
                              (root_ / "found").string(), more));
  };
  const auto sigma = [&] {
    return YAML::LoadFile(root_ / "found/model.yaml")["parameters"]["b_az"]["sigma"].as<double>();
  };
  ASSERT_EQ(diagnose("").exit_code, 0);
  const double alone = sigma();
  EXPECT_THAT(diagnose(fmt::format("--model='{}'", (root_ / "out/model.yaml").string())),
              Ends(0, HasSubstr("fitted to this very flight")));
  EXPECT_EQ(sigma(), alone);
}

TEST_F(CalibrateApp, AnEstimatorIsNamedOnce) {
  EXPECT_THAT(Calibrate("--estimator=vgd,vgd"), Refuses("'vgd' twice"));
}

TEST_F(CalibrateApp, AFailureLeavesEarlierResultsWhole) {
  ASSERT_EQ(Calibrate().exit_code, 0);
  const std::string before = ReadText(root_ / "out/calibration.yaml");
  std::filesystem::remove(root_ / "log/imu.csv");
  EXPECT_EQ(Calibrate().exit_code, 2);
  EXPECT_EQ(ReadText(root_ / "out/calibration.yaml"), before);
}

// From nothing to the page, by the commands of the README.
TEST_F(CalibrateApp, SlowFromSimulationToReport) {
  if (!std::filesystem::exists(App("simulate"))) GTEST_SKIP() << "trueline-simulate is not built";
  const std::string config =
      (testing_simulation::ConfigFolder() / "hippodrome_exact.yaml").string();
  const Outcome flown = RunApp(
      "simulate", fmt::format("--config='{}' --out='{}'", config, (root_ / "flight").string()));
  ASSERT_EQ(flown.exit_code, 0) << flown.err;
  const Outcome done =
      Run(fmt::format("--log='{}' --out='{}' --gamma_sweep=", (root_ / "flight").string(),
                      (root_ / "out").string()));
  if (done.err.find("python3-plotly") != std::string::npos) GTEST_SKIP() << done.err;
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string page = ReadText(root_ / "out/report.html");
  EXPECT_THAT(page, HasSubstr("id=\"plot-library\""));  // inside: the page opens offline
  EXPECT_LT(page.size(), 1500000U);
  for (const char* plot : {"plot-track", "plot-arcs", "plot-parameters", "plot-residuals"}) {
    EXPECT_THAT(page, HasSubstr(plot));
  }
}

}  // namespace
}  // namespace trueline
