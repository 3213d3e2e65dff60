#include "problems/inspection/following_filter.h"

#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <utility>

#include "problems/inspection/clear.h"
#include "problems/log/attitude_cursor.h"

namespace trueline {

std::vector<AttitudeSample> WithoutFollowing(const FlightLog& log,
                                             const std::vector<AttitudeSample>& attitude,
                                             double gain) {
  constexpr double kMemory = 20.0;  // s, after which an error of the integral is forgotten
  std::vector<AttitudeSample> corrected = attitude;
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();  // m/s^2
  AttitudeCursor cursor(attitude);
  std::size_t next = 0;
  for (std::size_t i = 0; i < log.imu.size(); ++i) {
    Eigen::Quaterniond q;
    if (cursor.At(log.imu[i].t, kAttitudeGap, &q) && i > 0) {
      const double dt = SecondsBetween(log.imu[i - 1].t, log.imu[i].t);
      tilt += dt * (gain * (q * log.imu[i].accel).head<2>() - tilt / kMemory);
    }
    for (; next < corrected.size() && corrected[next].t <= log.imu[i].t; ++next) {
      const Eigen::Vector3d turn = Eigen::Vector3d(tilt.y(), -tilt.x(), 0.0) / log.gravity;
      const double angle = turn.norm();
      if (angle == 0.0) continue;
      corrected[next].q_Ep_I = Eigen::AngleAxisd(angle, turn / angle) * corrected[next].q_Ep_I;
    }
  }
  return corrected;
}

std::optional<FollowingFit> FitFollowing(const FlightLog& log,
                                         const std::vector<AttitudeSample>& attitude,
                                         const MatchOfAttitude& of, double VectorMatch::*by) {
  constexpr int kBits = 8;  // of the logarithm
  const auto rest = [&](double logarithm) {
    const auto match = of(WithoutFollowing(log, attitude, std::exp(logarithm)));
    return match ? RestOf((*match).*by) : 1.0;
  };
  const double gain = std::exp(boost::math::tools::brent_find_minima(rest, std::log(kLowestGain),
                                                                     std::log(kHighestGain), kBits)
                                   .first);
  auto match = of(WithoutFollowing(log, attitude, gain));
  if (!match) return std::nullopt;
  return FollowingFit{gain, std::move(*match)};
}

}  // namespace trueline
