// Measured flights, imported by their maps and calibrated: the figures that the project promises.
#include <gtest/gtest.h>

#include "problems/calibration/calibration_config.h"
#include "problems/import/convert.h"
#include "tests/common/test_files.h"

namespace trueline {
namespace {

const std::filesystem::path kSource = TRUELINE_TEST_SOURCE_DIR;

FlightLog Import(const std::string& map, const std::filesystem::path& file) {
  return ConvertLog(ReadImportMap(kSource / "config/import" / map), {file.string()}, {});
}

Calibration CalibrateWith(const FlightLog& log, const std::string& config) {
  CalibrationFlags flags;
  flags.config = (kSource / "config/calibrate" / config).string();
  flags.estimators = "vgd";
  flags.gamma = 3;
  CalibrationOptions options = ResolveCalibrationOptions(flags);
  options.gamma_sweep.clear();
  return Calibrate(log, options);
}

TEST(RealFlight, SlowNanoBenchOval) {
  const auto file = DataFolder() / "nanobench/B7_oval_fast_rep2.csv";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is missing; set TRUELINE_DATA";
  const Calibration calibration = CalibrateWith(Import("nanobench.yaml", file), "default.yaml");
  const ArcSummary arcs = SummariseArcs(calibration.Reported());
  EXPECT_GE(arcs.error.count, 5);
  EXPECT_LT(arcs.error.mean, 0.25);  // m
  const ParameterEstimate& K_x = calibration.Reported().windows.back().parameters[0];
  EXPECT_EQ(K_x.name, "K_x");
  EXPECT_NEAR(K_x.value, -0.40, 0.15);  // 1/s, by regression of accelerometer on mocap velocity
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

}  // namespace
}  // namespace trueline
