// Measured flights, imported by their maps and calibrated: the stated results hold.
#include "problems/calibration/calibration_config.h"
#include "problems/diagnosis/imu_flight.h"
#include "problems/diagnosis/rules.h"
#include "problems/import/convert.h"
#include "problems/smoother/whole_flight.h"
#include "tests/common/bands.h"
#include "tests/common/test_files.h"

namespace trueline {
namespace {

const std::filesystem::path kSource = TRUELINE_TEST_SOURCE_DIR;

FlightLog Import(const std::string& map, const std::filesystem::path& file) {
  return ConvertLog(ReadImportMap(kSource / "config/import" / map), {file.string()}, {});
}

Calibration CalibrateWith(const FlightLog& log, const std::string& config,
                          const std::string& estimators = "vgd") {
  CalibrationFlags flags;
  flags.config = (kSource / "config/calibrate" / config).string();
  flags.estimators = estimators;
  flags.gamma = 3;
  CalibrationOptions options = ResolveCalibrationOptions(flags);
  options.gamma_sweep.clear();
  return Calibrate(log, options);
}

// A flight's drag K_x as config/README.md states it, 1/s, and the regression of the accelerometer
// on mocap velocity (-0.40 to -0.42). One log has one correct answer: it may change by half of its
// sigma.
void ExpectDrag(const ParameterEstimate& K_x, double value, double sigma) {
  constexpr double kRegression = -0.40;
  ASSERT_EQ(K_x.name, "K_x");
  EXPECT_NEAR(K_x.value, value, 0.5 * sigma);
  EXPECT_NEAR(K_x.value, kRegression, 3.3 * K_x.sigma);
  ExpectSigma(K_x.sigma, sigma, 1.3, "sigma of K_x");
}

TEST(RealFlight, SlowNanoBenchOval) {
  const auto file = DataFolder() / "nanobench/B7_oval_fast_rep2.csv";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is missing; set TRUELINE_DATA";
  const Calibration calibration = CalibrateWith(Import("nanobench.yaml", file), "default.yaml");
  const ArcSummary arcs = SummariseArcs(calibration.Reported());
  EXPECT_GE(arcs.error.count, 5);
  EXPECT_LT(arcs.error.mean, 0.16);  // m; currently 0.11
  ExpectDrag(calibration.Reported().windows.back().parameters[0], -0.372, 0.021);
}

// The whole flight's drag, of two flights of one vehicle.
TEST(RealFlight, SlowNanoBenchOvalsHaveOneDrag) {
  const auto folder = DataFolder() / "nanobench";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is missing; set TRUELINE_DATA";
  const auto drag = [&](const std::string& name) {
    const FlightLog log = Import("nanobench.yaml", folder / (name + ".csv"));
    return CalibrateWith(log, "default.yaml", "smoother").whole_flight.value().parameters.at(0);
  };
  const ParameterEstimate one = drag("B7_oval_fast_rep1"), two = drag("B7_oval_fast_rep2");
  ExpectDrag(one, -0.370, 0.011);
  ExpectDrag(two, -0.381, 0.012);
  EXPECT_LT(std::abs(one.value - two.value), 3.3 * std::hypot(one.sigma, two.sigma));
}

TEST(RealFlight, SlowRacerWithRealDetections) {
  const auto file = DataFolder() / "li_trashcan_race/6019.csv";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is missing; set TRUELINE_DATA";
  const Calibration calibration =
      CalibrateWith(Import("li_trashcan_race.yaml", file), "racer.yaml");
  const ArcSummary arcs = SummariseArcs(calibration.Reported());
  EXPECT_GE(arcs.error.count, 5);
  EXPECT_LT(arcs.error.mean, 0.6);  // m
}

// The Crazyflie's filter fuses positions and ignores drag. Two laboratories' flights show it, with
// mocap, which sees the attitude itself, and without.
TEST(RealFlight, SlowTheCrazyfliesFilterKnowsNoDrag) {
  for (const auto& [map, name, has_attitude] :
       {std::tuple{"nanobench.yaml", "nanobench/B7_oval_fast_rep2.csv", true},
        std::tuple{"nanobench.yaml", "nanobench/B9_trefoil_fast_rep1.csv", true},
        std::tuple{"idsia_nanodrone.yaml", "idsia_nanodrone/random1_20251017_run1.csv", false}}) {
    const auto file = DataFolder() / name;
    if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is missing; set TRUELINE_DATA";
    FlightLog log = Import(map, file);
    for (const bool mocap : {true, false}) {
      if (!mocap) log.mocap.clear();
      const std::vector<Cause> causes = Diagnose({log}, ImuDiagnosisOptions()).causes;
      ASSERT_FALSE(causes.empty()) << name << (mocap ? "" : " without mocap");
      const Cause& cause = causes.front();
      EXPECT_EQ(cause.candidate.id(), "ahrs_drag_error") << name;
      EXPECT_GT(cause.value[0], 0.2);
      EXPECT_LT(cause.value[0], 0.45);
      EXPECT_EQ(cause.witness.says, "confirms") << cause.witness.text;
      EXPECT_EQ(cause.witness.stream, mocap && has_attitude ? "mocap attitude" : "gyroscope");
    }
  }
}

// The heading wanders by some degrees on this flight, and forces go with what no effect states.
// Both could take the drift's place: noise learned without it, and terms of the open catalogue. It
// is significant and has the right size; whether it is named depends on a gain that may be zero.
TEST(RealFlight, SlowNanoDroneShowsADriftOfItsHeading) {
  const auto file = DataFolder() / "idsia_nanodrone/random1_20251017_run1.csv";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is missing; set TRUELINE_DATA";
  constexpr double kDrift = 0.009;  // rad/s
  FlightLog log = Import("idsia_nanodrone.yaml", file);
  log.mocap.clear();  // its attitude is the logged one
  for (AttitudeSample& sample : log.attitude) {
    const double psi = kDrift * SecondsBetween(log.imu.front().t, sample.t);
    sample.q_Ep_I = Eigen::AngleAxisd(-psi, Eigen::Vector3d::UnitZ()) * sample.q_Ep_I;
  }
  const Diagnosis diagnosis = Diagnose({log}, ImuDiagnosisOptions());
  std::vector<Cause> found = diagnosis.causes;
  found.insert(found.end(), diagnosis.set_aside.begin(), diagnosis.set_aside.end());
  const auto cause = std::ranges::find(
      found, "heading_drift", [](const Cause& c) -> std::string { return c.candidate.id(); });
  ASSERT_NE(cause, found.end());
  EXPECT_NEAR(cause->value[0], kDrift, 3.3 * cause->sigma[0]);
}

}  // namespace
}  // namespace trueline
