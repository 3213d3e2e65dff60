// The result files: names, columns and keys that other programs read, written whole or not at all.
#include <fstream>
#include <sstream>

#include "problems/calibration/calibration_config.h"
#include "problems/calibration/write_calibration.h"
#include "problems/common/error.h"
#include "tests/common/test_files.h"
#include "tests/vgd/flights.h"

namespace trueline {
namespace {

using testing::StartsWith;

std::vector<std::string> LinesOf(const std::filesystem::path& path) {
  std::istringstream text(ReadText(path));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

const FlightLog& Lap() {
  static const FlightLog log = [] {
    FlightLog lap = testing_simulation::Fly(testing_vgd::ExactHippodrome(15.0), 3).log;
    lap.name = "lap, \"fast\"";
    lap.directory = "flights/lap";
    lap.sha256 = {{"imu.csv", "00ff"}};
    return lap;
  }();
  return log;
}

CalibrationOptions Options() {
  CalibrationOptions options;
  options.gamma_sweep = {1};
  options.methods.vgd.gamma = 2;
  return options;
}

const Calibration& OfLap() {
  static const Calibration calibration = Calibrate(Lap(), Options());
  return calibration;
}

class WrittenFlight : public testing::Test {
 protected:
  void Write() const {
    WriteCalibration(OfLap(), Lap(), Provenance(Lap(), 7, ToYaml(Options())), out_.directory());
  }

  const TestFolder out_;
};

TEST_F(WrittenFlight, CalibrationYamlHasTheAgreedKeys) {
  Write();
  const YAML::Node node = YAML::LoadFile(out_ / "calibration.yaml");
  EXPECT_EQ(node["verdict"].as<std::string>(), OfLap().verdict.word);
  EXPECT_TRUE(node["reasons"].IsSequence() && node["unobservable"].IsSequence());
  EXPECT_EQ(node["estimator"].as<std::string>(), "vgd");
  const WindowEstimate& last = OfLap().Reported().windows.back();
  for (const ParameterEstimate& p : last.parameters) {
    const YAML::Node entry = node["parameters"][p.name];
    EXPECT_NEAR(entry["value"].as<double>(), p.value, 1e-5 * std::abs(p.value));
    EXPECT_NEAR(entry["sigma"].as<double>(), p.sigma, 1e-2 * p.sigma);
    EXPECT_EQ(entry["unit"].as<std::string>(), p.unit);
    EXPECT_EQ(entry["status"].as<std::string>(), p.status);
  }
  const YAML::Node error = node["arcs"]["final_point_error"];
  const ArcSummary arcs = SummariseArcs(OfLap().Reported());
  EXPECT_EQ(node["arcs"]["count"].as<int>(), arcs.error.count);
  EXPECT_NEAR(error["mean"].as<double>(), arcs.error.mean, 1e-3 * arcs.error.mean);
  EXPECT_NEAR(error["median"].as<double>(), arcs.error.median, 1e-3);
  EXPECT_NEAR(error["p95"].as<double>(), arcs.error.p95, 1e-3);
  EXPECT_EQ(error["unit"].as<std::string>(), "m");
  EXPECT_NEAR(node["arcs"]["inside_95_ellipse"].as<double>(), arcs.Coverage(), 1e-2);
}

TEST_F(WrittenFlight, ProvenanceIsCompleteAndItsConfigurationReadsBack) {
  Write();
  const YAML::Node node = YAML::LoadFile(out_ / "calibration.yaml")["provenance"];
  EXPECT_FALSE(node["version"].as<std::string>().empty());
  EXPECT_EQ(node["log"].as<std::string>(), "flights/lap");
  EXPECT_EQ(node["sha256"]["imu.csv"].as<std::string>(), "00ff");
  EXPECT_EQ(node["seed"].as<int>(), 7);
  YAML::Node config = YAML::Clone(node["config"]);
  EXPECT_EQ(config["estimators"][0].as<std::string>(), "vgd");
  EXPECT_EQ(config["gamma_sweep"][0].as<int>(), 1);
  config.remove("estimators");
  config.remove("gamma_sweep");
  EXPECT_EQ(FromYaml<EstimatorOptions>(YamlMap(config, "provenance", "")).vgd.gamma, 2);
}

TEST_F(WrittenFlight, TablesHaveTheAgreedColumns) {
  Write();
  const std::vector<std::string> arcs = LinesOf(out_ / "arcs.csv");
  EXPECT_THAT(arcs[0],
              StartsWith("log,estimator,gamma,tau,t_start [s],t_end [s],final_point_error [m],"
                         "predicted_sigma [m],iterations [1],solve_time [s],truth"));
  std::size_t expected = 1;
  for (const EstimatorRun& run : OfLap().runs) {
    for (const WindowEstimate& window : run.windows) expected += window.arc.has_value();
  }
  EXPECT_EQ(arcs.size(), expected);
  EXPECT_THAT(arcs[1], StartsWith("\"lap, \"\"fast\"\"\",vgd,1,1,"));  // one field, RFC 4180
  EXPECT_THAT(LinesOf(out_ / "trajectory.csv")[0],
              StartsWith("t [s],estimator,kind,tau,x [m],y [m],z [m],vx [m/s]"));
  EXPECT_THAT(LinesOf(out_ / "windows.csv")[0],
              StartsWith("log,estimator,gamma,tau,t_start [s],t_end [s],parameter,value,sigma"));
  EXPECT_THAT(LinesOf(out_ / "residuals.csv")[0], StartsWith("log,estimator,gamma,tau,t [s]"));
}

TEST_F(WrittenFlight, TheModelIsAPriorForTheNextFlight) {
  Write();
  const YAML::Node node = YAML::LoadFile(out_ / "model.yaml");
  EXPECT_TRUE(node["effects"].IsSequence());
  EXPECT_EQ(node["effects"].size(), 0U);
  EXPECT_EQ(node["provenance"]["log"].as<std::string>(), "flights/lap");
  VgdOptions options;
  ApplyModel(out_ / "model.yaml", &options);
  const WindowEstimate& last = OfLap().Reported().windows.back();
  for (const int i : {0, 1, 2, 6, 7, 8}) {
    EXPECT_NEAR(options.priors[i].mean, last.parameters[i].value, 1e-5) << i;
    EXPECT_NEAR(options.priors[i].sigma, last.parameters[i].sigma, 1e-2 * options.priors[i].sigma);
  }
}

TEST_F(WrittenFlight, TheTableShowsEveryRunAndTheVerdict) {
  const std::string table = CalibrationTable(OfLap());
  EXPECT_THAT(table, HasSubstr("estimator      gamma   arcs  mean [m]"));
  EXPECT_THAT(table, HasSubstr("K_x"));
  EXPECT_THAT(table, HasSubstr("verdict: " + OfLap().verdict.word));
}

TEST_F(WrittenFlight, AFailureLeavesTheOldFileWholeAndNoRubbish) {
  Write();
  const std::string before = ReadText(out_ / "arcs.csv");
  std::filesystem::remove(out_ / "windows.csv");
  std::filesystem::create_directory(out_ / "windows.csv");  // can't be replaced by a file
  std::ofstream(out_ / "windows.csv/keep") << "x";
  EXPECT_THROW(Write(), InputError);
  EXPECT_EQ(ReadText(out_ / "arcs.csv").size(), before.size());
  EXPECT_NO_THROW(YAML::LoadFile(out_ / "calibration.yaml"));
  for (const auto& entry : std::filesystem::directory_iterator(out_.directory())) {
    EXPECT_THAT(entry.path().string(), Not(HasSubstr(".tmp.")));
  }
}

// A flight without a single window still gives complete files.
TEST_F(WrittenFlight, NoWindowsGiveFilesToo) {
  Calibration none;
  none.runs = {{"vgd", 3, {}, {}}};
  none.verdict = Judge(none.runs[0]);
  WriteCalibration(none, Lap(), Provenance(Lap(), 0, ToYaml(Options())), out_.directory());
  const YAML::Node node = YAML::LoadFile(out_ / "calibration.yaml");
  EXPECT_EQ(node["verdict"].as<std::string>(), "unusable");
  EXPECT_TRUE(node["parameters"].IsMap());
  EXPECT_EQ(node["arcs"]["count"].as<int>(), 0);
  EXPECT_EQ(LinesOf(out_ / "arcs.csv").size(), 1U);
  EXPECT_THAT(CalibrationTable(none), Not(HasSubstr("nan")));
}

}  // namespace
}  // namespace trueline
