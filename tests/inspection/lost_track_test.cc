// Rows that a tracker writes while it does not see the vehicle.
#include <cmath>

#include "problems/inspection/stuck.h"
#include "tests/common/matchers.h"

namespace trueline {
namespace {

// Circles of 3 m about (5, 0, -1), which turn the vehicle by 1 rad/s; mocap at `rate`.
FlightLog Circles(double rate) {
  FlightLog log;
  for (int i = 0; i < 20 * rate; ++i) {
    const double t = i / rate;
    const TimeNs stamp = FromSeconds(t);
    log.imu.push_back({stamp, {0, -3, -9.81}, {0, 0, 1}});
    log.mocap.push_back({stamp,
                         {5 + 3 * std::sin(t), 3 * std::cos(t), -1},
                         Eigen::Quaterniond(std::cos(t / 2), 0, 0, std::sin(t / 2))});
  }
  return log;
}

TEST(LostTrack, ZerosAreNamedWithAllPlacesAndLeftOut) {
  for (const double rate : {20.0, 100.0, 1000.0}) {
    FlightLog log = Circles(rate);
    EXPECT_THAT(FindLostTracks(log), IsEmpty()) << rate;
    for (PoseSample& pose : log.mocap) {
      const double t = ToSeconds(pose.t);
      const bool blind = (t >= 4 && t < 4.8) || (t >= 12 && t < 12.8);
      if (blind) pose.p_E.setZero();
      if (blind) pose.q_E = Eigen::Quaterniond::Identity();
    }
    const std::size_t all = log.mocap.size();
    ASSERT_EQ(FindLostTracks(log).size(), 1U) << rate;
    const std::vector<std::string> warnings = LeaveOutLostTracks(&log);
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_THAT(warnings.front(), HasSubstr("exactly 0 0 0 in 2 stretches (4.000 to "));
    EXPECT_EQ(all - log.mocap.size(), static_cast<std::size_t>(std::lround(1.6 * rate)));
    EXPECT_THAT(FindLostTracks(log), IsEmpty()) << rate;
  }
}

TEST(LostTrack, AStartAtTheOriginIsNone) {
  FlightLog log = Circles(100.0);
  for (PoseSample& pose : log.mocap) {
    pose.p_E = Eigen::Vector3d(std::max(0.0, ToSeconds(pose.t) - 2.0), 0, 0);
  }
  EXPECT_THAT(FindLostTracks(log), IsEmpty());
}

// A position may be held while the attitude goes on.
TEST(LostTrack, HeldPlacesAreNamedAndLeftOut) {
  for (const double rate : {20.0, 100.0, 1000.0}) {
    FlightLog log = Circles(rate);
    Eigen::Vector3d last = Eigen::Vector3d::Zero();
    for (PoseSample& pose : log.mocap) {
      const double t = ToSeconds(pose.t);
      const bool held = (t > 4 && t < 4.6) || (t > 12 && t < 12.6);
      if (held) pose.p_E = last;
      if (!held) last = pose.p_E;
    }
    const std::vector<LostTrack> lost = FindLostTracks(log);
    ASSERT_EQ(lost.size(), 1U) << rate;
    EXPECT_THAT(lost.front().Text(), HasSubstr("one value is held, while the vehicle moves, in 2"));
    LeaveOutLostTracks(&log);
    EXPECT_THAT(FindLostTracks(log), IsEmpty()) << rate;
    for (const PoseSample& pose : log.mocap) {
      const double t = ToSeconds(pose.t);
      EXPECT_NEAR(pose.p_E.x(), 5 + 3 * std::sin(t), 1e-9);
    }
  }
}

TEST(LostTrack, AVehicleThatWaitsIsNotHeld) {
  FlightLog log = Circles(100.0);
  for (PoseSample& pose : log.mocap) {  // it stops from 5 to 9 s, seen in steps of 1 mm
    const double t = ToSeconds(pose.t);
    const double turn = t < 5 ? t : t < 9 ? 5 : t - 4;
    pose.p_E = {std::round(3e3 * std::sin(turn)) * 1e-3, std::round(3e3 * std::cos(turn)) * 1e-3,
                -1};
  }
  EXPECT_THAT(FindLostTracks(log), IsEmpty());
}

// A sensor that is slower than its rows holds every value for as long.
TEST(LostTrack, ASlowSensorIsNotHeld) {
  FlightLog log = Circles(100.0);
  for (std::size_t i = 0; i < log.mocap.size(); ++i) log.mocap[i].p_E = log.mocap[i - i % 20].p_E;
  EXPECT_THAT(FindLostTracks(log), IsEmpty());
}

TEST(LostTrack, PosesOfAnotherMarkerSetAreNamedAndLeftOut) {
  for (const double rate : {20.0, 100.0, 1000.0}) {
    FlightLog log = Circles(rate);
    const Eigen::Quaterniond other(
        Eigen::AngleAxisd(1.6, Eigen::Vector3d(0.2, 0.3, 0.9).normalized()));
    for (PoseSample& pose : log.mocap) {
      const double t = ToSeconds(pose.t);
      if (!((t >= 4 && t < 5) || (t >= 12 && t < 14))) continue;
      pose.p_E += pose.q_E * Eigen::Vector3d(0.05, 0.03, 0.02);
      pose.q_E = pose.q_E * other;
    }
    const std::size_t all = log.mocap.size();
    const std::vector<LostTrack> lost = FindLostTracks(log);
    ASSERT_EQ(lost.size(), 1U) << rate;
    EXPECT_THAT(lost.front().Text(), HasSubstr("in 2 stretches (4.000 to "));
    EXPECT_NEAR(lost.front().Seconds(), 3.0, 2.5 / rate);
    LeaveOutLostTracks(&log);
    EXPECT_EQ(all - log.mocap.size(), static_cast<std::size_t>(std::lround(3 * rate)));
    EXPECT_THAT(FindLostTracks(log), IsEmpty()) << rate;
  }
}

// The gyroscope goes on in the same body axes: a filter was reset, or the stamps are those of
// another clock.
TEST(LostTrack, JumpsThatTheGyroscopeContradictsAreNoOtherMarkers) {
  FlightLog log = Circles(100.0);
  for (PoseSample& pose : log.mocap) {
    const double t = ToSeconds(pose.t);
    const double roll = 0.5 * std::sin(3 * t);
    pose.q_E = pose.q_E * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
    if (t > 15) pose.q_E = Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitZ()) * pose.q_E;
  }
  for (ImuSample& sample : log.imu) {
    const double t = ToSeconds(sample.t), roll = 0.5 * std::sin(3 * t);
    sample.gyro = {1.5 * std::cos(3 * t), std::sin(roll), std::cos(roll)};
  }
  EXPECT_THAT(FindLostTracks(log), IsEmpty());
}

// A vehicle that tumbles turns by as much as its gyroscope says.
TEST(LostTrack, FastTurnsAreNoOtherMarkers) {
  FlightLog log = Circles(20.0);
  for (ImuSample& sample : log.imu) sample.gyro = {0, 0, 24};
  for (PoseSample& pose : log.mocap) {
    pose.q_E = Eigen::AngleAxisd(24 * ToSeconds(pose.t), Eigen::Vector3d::UnitZ());
  }
  EXPECT_THAT(FindLostTracks(log), IsEmpty());
}

}  // namespace
}  // namespace trueline
