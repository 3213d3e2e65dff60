// The filter over whole flights: results by pass, gaps, options.
#include <gtest/gtest.h>

#include "problems/calibration/estimators.h"
#include "problems/common/error.h"
#include "problems/ekf/ekf.h"
#include "problems/result/statistics.h"
#include "problems/simulation/simulate.h"
#include "problems/vgd/drive_track.h"
#include "tests/common/bands.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

const Eigen::Vector3d kAccelBias(0.12, -0.10, 0.15), kGyroBias(0.006, -0.004, 0.005);

const FlightLog& Hippodrome() {
  static const FlightLog log = [] {
    SimulationConfig config = testing_simulation::ReadShipped("hippodrome", 50.0);
    config.warm_up = 5.0;
    config.imu.rate = 256.0;
    config.imu.accel_bias = kAccelBias;
    config.imu.gyro_bias = kGyroBias;
    return Simulate(config, 4);
  }();
  return log;
}

FlightData DataOf(const FlightLog& log) {
  return FlightData(log, DriveOptions(), PassOptions(), DragMeasurementOptions());
}

std::vector<double> Errors(const EstimatorRun& run, int from_tau) {
  std::vector<double> errors;
  for (const WindowEstimate& window : run.windows) {
    if (window.arc && window.tau >= from_tau) errors.push_back(window.arc->FinalPointError());
  }
  return errors;
}

TEST(EkfRunTest, ConvergesToBiasesAndPredictsArcs) {
  const FlightData flight = DataOf(Hippodrome());
  for (const AttitudeForm form : {AttitudeForm::kEuler, AttitudeForm::kErrorState}) {
    EkfOptions options;
    options.attitude = form;
    const EstimatorRun run = RunEkf(flight, options, 3);
    ASSERT_EQ(run.windows.size(), flight.passes.size());
    const WindowEstimate& last = run.windows.back();
    Eigen::Matrix<double, 6, 1> truth;
    truth << kAccelBias, kGyroBias;
    for (int i = 0; i < 6; ++i) {
      const ParameterEstimate& found = last.parameters[i];
      EXPECT_NEAR(found.value, truth[i], 4.0 * found.sigma) << found.name;
      EXPECT_EQ(found.status, "identified") << found.name;
    }
    EXPECT_LT(Quantile(Errors(run, 5), 0.5), 0.7);
    ExpectCovered(CountArcs(run));
  }
}

// No window's estimate depends on later data: the run over a log that is cut at its end is the same
// up to the cut.
TEST(EkfRunTest, IsCausal) {
  const FlightData whole = DataOf(Hippodrome());
  FlightLog cut = Hippodrome();
  const TimeNs end = whole.passes[4].end;
  cut.fixes.resize(whole.passes[4].last + 1);
  EkfOptions options;
  options.gyro_from_log = false;
  const EstimatorRun all = RunEkf(whole, options, 1);
  const EstimatorRun part = RunEkf(DataOf(cut), options, 1);
  ASSERT_EQ(part.windows.back().end, end);
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(part.windows[4].parameters[i].value, all.windows[4].parameters[i].value);
  }
  EXPECT_EQ(part.windows[3].arc->p_E, all.windows[3].arc->p_E);
}

// Like the windows of other estimators: an arc's prediction uses no fix of the arc, later ones do.
TEST(EkfRunTest, UsesWithheldFixesOnceTheirArcIsJudged) {
  SimulationConfig config = testing_simulation::ReadShipped("gnss", 40.0);
  const FlightLog log = Simulate(config, 4);
  const FlightData flight = DataOf(log);
  ASSERT_TRUE(flight.continuous);
  ASSERT_GE(flight.passes.size(), 4U);
  ASSERT_GT(flight.passes[2].first, flight.passes[1].last + 1);
  FlightLog shifted_log = log;
  for (Fix& fix : shifted_log.fixes) {
    if (fix.t > flight.passes[1].end && fix.t < flight.passes[2].begin) fix.p_E.x() += 0.3;
  }
  const FlightData shifted_flight = DataOf(shifted_log);
  for (const bool iterated : {false, true}) {
    EkfOptions options;
    options.iterated = iterated;
    const EstimatorRun run = RunEkf(flight, options, 1);
    const EstimatorRun shifted = RunEkf(shifted_flight, options, 1);
    ASSERT_TRUE(run.windows[2].arc && shifted.windows[2].arc);
    EXPECT_EQ(run.windows[1].arc->p_E, shifted.windows[1].arc->p_E);
    EXPECT_GT((run.windows[2].arc->p_E - shifted.windows[2].arc->p_E).norm(), 1e-3);
    EXPECT_EQ(run.windows[2].misfits.size(), flight.passes[2].last - flight.passes[1].last);
  }
}

TEST(EkfRunTest, StartsAnewAfterAnImuGapAndKeepsTheBiases) {
  FlightLog log = Hippodrome();
  const FlightData whole = DataOf(log);
  const TimeNs from = whole.passes[7].end + FromSeconds(0.2), to = from + FromSeconds(0.6);
  std::erase_if(log.imu, [&](const ImuSample& s) { return s.t > from && s.t < to; });
  const FlightData flight = DataOf(log);
  ASSERT_FALSE(flight.HasArc(8));
  const EstimatorRun run = RunEkf(flight, EkfOptions(), 1);
  EXPECT_FALSE(run.windows[7].arc);
  ASSERT_FALSE(run.warnings.empty());
  EXPECT_NE(run.warnings.back().find("starts anew"), std::string::npos);
  ASSERT_TRUE(run.windows[8].arc);
  EXPECT_LT(run.windows[8].parameters[2].sigma, 0.1);  // b_az is kept
  // Attitude and velocity were estimated again within one pass; the covariance covers the error.
  EXPECT_TRUE(run.windows[8].arc->Inside95());
  EXPECT_GT(run.windows[8].arc->PredictedSigma(), 3.0 * run.windows[6].arc->PredictedSigma());
}

TEST(EkfRunTest, IterationChangesWideUncertaintiesAndSettles) {
  const FlightData flight = DataOf(Hippodrome());
  EkfOptions options;
  const EstimatorRun plain = RunEkf(flight, options, 1);
  options.iterated = true;
  const EstimatorRun iterated = RunEkf(flight, options, 1);
  const auto error = [](const EstimatorRun& run) { return Quantile(Errors(run, 1), 0.5); };
  EXPECT_NE(plain.windows[1].parameters[0].value, iterated.windows[1].parameters[0].value);
  EXPECT_LT(error(iterated), 1.5 * error(plain));
}

TEST(EkfRunTest, GateKeepsOutliersOut) {
  FlightLog log = Hippodrome();
  for (std::size_t i = 60; i < log.fixes.size(); i += 6) log.fixes[i].p_E.x() += 3.0;
  const FlightData flight = DataOf(log);
  EkfOptions open;
  open.gating = EkfGating::kNone;
  const double gated = Mean(Errors(RunEkf(flight, EkfOptions(), 1), 5));
  EXPECT_LT(gated, 0.5 * Mean(Errors(RunEkf(flight, open, 1), 5)));
}

TEST(GyroScatterTest, GrowsWithTheGyroscopesNoise) {
  FlightLog log = Hippodrome();
  const DriveTrack track = DriveTrack::FromLog(log, DriveOptions());
  const Eigen::Vector3d clean = GyroScatter(ImuInputs(log, track));
  Random random(1, "gyro");
  constexpr double kDensity = 0.02;
  const double sigma = kDensity * std::sqrt(256.0);
  for (ImuSample& sample : log.imu) sample.gyro += sigma * random.NormalVector3();
  const Eigen::Vector3d noisy = GyroScatter(ImuInputs(log, track));
  for (int axis = 0; axis < 3; ++axis) {
    const double expected = std::hypot(clean[axis], kDensity);
    EXPECT_NEAR(noisy[axis], expected, 0.2 * expected);
  }
}

TEST(EkfOptionsTest, ThePapersP0IsGivenByBlock) {
  EstimatorOptions options = FromYaml<EstimatorOptions>(
      YamlMap(YAML::Load("ekf: {tuning: paper, paper: {p0: [1, 2, 3, 4, 5]}}"), "test.yaml", ""));
  const Matrix15d P = Ekf(options.ekf, 9.81).StartCovariance(NavState{});
  for (int i = 0; i < kNavSize; ++i) EXPECT_EQ(P(i, i), 1.0 + i / 3) << i;
}

TEST(EkfOptionsTest, SurviveYamlAndRefuseNonsense) {
  EstimatorOptions options;
  options.ekf.tuning = EkfTuning::kPaper;
  options.ekf.attitude = AttitudeForm::kEuler;
  options.ekf.iterated = true;
  options.kinematic.initial_attitude = false;
  const YAML::Node node = ToYaml(options);
  const EstimatorOptions back = FromYaml<EstimatorOptions>(YamlMap(node, "test.yaml", ""));
  EXPECT_EQ(back.ekf.tuning, EkfTuning::kPaper);
  EXPECT_TRUE(back.ekf.iterated);
  EXPECT_FALSE(back.kinematic.initial_attitude);
  for (const char* bad :
       {"ekf: {tuning: best}", "ekf: {nois: {}}", "ekf: {paper: {p0: [10, 10, 10, 10, 0]}}",
        "ekf: {paper: {q_per_sample: [1, 2]}}", "kinematic: {tilt_sigma_deg: 0}"}) {
    EXPECT_THROW(FromYaml<EstimatorOptions>(YamlMap(YAML::Load(bad), "test.yaml", "")), InputError)
        << bad;
  }
}

}  // namespace
}  // namespace trueline
