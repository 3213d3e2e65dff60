// Rows that a tracker writes while it does not see the vehicle.
#include "problems/inspection/lost_track.h"

#include <gmock/gmock.h>

#include <cmath>

namespace trueline {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

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

}  // namespace
}  // namespace trueline
