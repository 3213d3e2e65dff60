// The drive of the model from a log: irregular steps, gaps, streams at other rates, sources.
#include "problems/vgd/drive_track.h"

#include "tests/common/test_files.h"
#include "tests/vgd/flown_log.h"

namespace trueline::testing_window {
namespace {

double Duration(const DriveTrack& track, double from, double to) {
  double sum = 0.0;
  track.ForEachStep(FromSeconds(from), FromSeconds(to),
                    [&](const Drive& /*drive*/, double dt) { sum += dt; });
  return sum;
}

void RemoveBetween(double from, double to, FlightLog* log) {
  const auto inside = [&](const auto& s) {
    return s.t > FromSeconds(from) && s.t < FromSeconds(to);
  };
  std::erase_if(log->imu, inside);
}

void ExpectTrueDrive(const DriveTrack& track, double tolerance) {
  for (const DriveStep& step : track.steps()) {
    const double middle = ToSeconds(step.t) + 0.5 * step.dt;
    const Eigen::Matrix3d expected = AttitudeAt(middle).toRotationMatrix();
    ASSERT_LT((step.drive.R_Ep_I - expected).norm(), tolerance) << "at " << middle;
    ASSERT_NEAR(step.drive.a_z, ThrustAt(middle), tolerance) << "at " << middle;
  }
}

TEST(DriveTrack, HoldsTheDriveAtTheMiddleOfEachStep) {
  const DriveTrack track = DriveTrack::FromLog(FlownLog(2.0), DriveOptions());
  EXPECT_EQ(track.steps().size(), 800U);
  EXPECT_TRUE(track.Covers(0, FromSeconds(2.0)));
  EXPECT_FALSE(track.Covers(-1, FromSeconds(1.0)));
  EXPECT_FALSE(track.Covers(0, FromSeconds(2.0) + 1));
  ExpectTrueDrive(track, 1e-4);
}

TEST(DriveTrack, TakesIrregularSteps) {
  FlightLog log = FlownLog(2.0);
  for (std::size_t i = 1; i + 1 < log.imu.size(); ++i) {
    const double t = (static_cast<double>(i) + 0.3 * std::sin(2.0 * i)) / 400.0;
    log.imu[i] = {FromSeconds(t), {0, 0, ThrustAt(t)}, Eigen::Vector3d::Zero()};
  }
  const DriveTrack track = DriveTrack::FromLog(log, DriveOptions());
  ExpectTrueDrive(track, 2e-4);
  EXPECT_NEAR(Duration(track, 0.3712, 1.9173), 1.9173 - 0.3712, 1e-9);
}

TEST(DriveTrack, BridgesAShortGapAtTheStreamsOwnStep) {
  FlightLog log = FlownLog(2.0);
  RemoveBetween(1.0, 1.1, &log);
  const DriveTrack track = DriveTrack::FromLog(log, DriveOptions());
  EXPECT_TRUE(track.Covers(0, FromSeconds(2.0)));
  EXPECT_TRUE(track.gaps().empty());
  EXPECT_EQ(track.steps().size(), 800U);  // steps replace the lost samples
  ExpectTrueDrive(track, 0.02);           // the thrust is interpolated over 0.1 s
}

TEST(DriveTrack, IntegratesNothingThroughALongGap) {
  FlightLog log = FlownLog(2.0);
  RemoveBetween(1.0, 1.4, &log);
  const DriveTrack track = DriveTrack::FromLog(log, DriveOptions());
  ASSERT_EQ(track.gaps().size(), 1U);
  EXPECT_EQ(track.gaps()[0].begin, FromSeconds(1.0));
  EXPECT_EQ(track.gaps()[0].end, FromSeconds(1.4));
  EXPECT_FALSE(track.Covers(FromSeconds(0.5), FromSeconds(1.2)));
  EXPECT_FALSE(track.Covers(FromSeconds(1.1), FromSeconds(1.2)));
  EXPECT_TRUE(track.Covers(FromSeconds(0.2), FromSeconds(1.0)));
  EXPECT_TRUE(track.Covers(FromSeconds(1.4), FromSeconds(1.9)));
  EXPECT_NEAR(Duration(track, 0.2, 1.0), 0.8, 1e-9);
  EXPECT_NEAR(Duration(track, 1.4, 1.9), 0.5, 1e-9);
}

TEST(DriveTrack, TakesAttitudeAtAnotherRateAndPhase) {
  FlightLog log = FlownLog(2.0);
  log.attitude.clear();
  for (double t = -0.013; t < 2.1; t += 0.021)
    log.attitude.push_back({FromSeconds(t), AttitudeAt(t)});
  ExpectTrueDrive(DriveTrack::FromLog(log, DriveOptions()), 2e-3);
}

TEST(DriveTrack, AHoleInTheAttitudeIsAGap) {
  FlightLog log = FlownLog(2.0);
  std::erase_if(log.attitude, [](const AttitudeSample& s) {
    return s.t > FromSeconds(1.0) && s.t < FromSeconds(1.5);
  });
  const DriveTrack track = DriveTrack::FromLog(log, DriveOptions());
  EXPECT_FALSE(track.Covers(FromSeconds(1.1), FromSeconds(1.2)));
  EXPECT_TRUE(track.Covers(FromSeconds(1.5), FromSeconds(2.0)));
}

TEST(DriveTrack, UndoesTheAttitudesLatency) {
  FlightLog log = FlownLog(2.0);
  for (AttitudeSample& sample : log.attitude)
    sample.q_Ep_I = AttitudeAt(ToSeconds(sample.t) - 0.05);
  DriveOptions options;
  options.attitude_latency = 0.05;
  ExpectTrueDrive(DriveTrack::FromLog(log, options), 1e-4);
}

TEST(DriveTrack, LevelFlightHoldsTheAltitude) {
  DriveOptions options;
  options.thrust = ThrustSource::kLevelFlight;
  const FlightLog log = FlownLog(2.0);
  const DriveTrack track = DriveTrack::FromLog(log, options);
  for (const DriveStep& step : track.steps()) {
    // Gravity and thrust along the body's z axis leave no vertical acceleration.
    EXPECT_NEAR(9.81 + step.drive.R_Ep_I(2, 2) * step.drive.a_z, 0.0, 1e-12);
  }
}

// Without an attitude stream the complementary filter runs: it starts level and follows the gyro.
TEST(DriveTrack, RunsItsOwnFilterWithoutAttitude) {
  FlightLog log = FlownLog(2.0);
  log.attitude.clear();
  for (ImuSample& sample : log.imu) sample.gyro = Eigen::Vector3d(0.0, 0.0, 0.7);
  for (ImuSample& sample : log.imu) sample.accel = Eigen::Vector3d(0.0, 0.0, -9.81);
  const DriveTrack track = DriveTrack::FromLog(log, DriveOptions());
  EXPECT_TRUE(track.Covers(0, FromSeconds(2.0)));
  const DriveStep last = track.steps().back();
  const double t = ToSeconds(last.t) + 0.5 * last.dt;
  const Eigen::Matrix3d expected =
      Eigen::AngleAxisd(0.7 * t, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_LT((last.drive.R_Ep_I - expected).norm(), 1e-6);
}

TEST(DriveTrack, TheFilterIsTakenWhereAskedForThoughAttitudeIsLogged) {
  FlightLog log = FlownLog(2.0);
  for (ImuSample& sample : log.imu) sample.accel = Eigen::Vector3d(0.0, 0.0, -9.81);
  DriveOptions options;
  options.attitude = AttitudeSource::kComplementaryFilter;
  const DriveTrack track = DriveTrack::FromLog(log, options);
  EXPECT_LT((track.steps().back().drive.R_Ep_I - Eigen::Matrix3d::Identity()).norm(), 1e-9);
}

// The latency is that of the logged attitude.
TEST(DriveTrack, TheOwnFilterIsNotLate) {
  const FlightLog log = FlownLog(2.0);
  DriveOptions prompt, late;
  prompt.attitude = late.attitude = AttitudeSource::kComplementaryFilter;
  late.attitude_latency = 0.1;
  const DriveTrack a = DriveTrack::FromLog(log, prompt), b = DriveTrack::FromLog(log, late);
  ASSERT_EQ(a.steps().size(), b.steps().size());
  EXPECT_EQ(a.steps().back().drive.R_Ep_I, b.steps().back().drive.R_Ep_I);
}

TEST(DriveTrack, RefusesStreamsThatDoNotOverlap) {
  FlightLog log = FlownLog(1.0);
  for (AttitudeSample& sample : log.attitude) sample.t += 100 * kNsPerSecond;
  EXPECT_THAT(ErrorOf([&] { DriveTrack::FromLog(log, DriveOptions()); }),
              HasSubstr("do not overlap in time"));
}

}  // namespace
}  // namespace trueline::testing_window
