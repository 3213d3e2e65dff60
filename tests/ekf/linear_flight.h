// Flights drawn from the kinematic model itself, for tests of estimators that assume it.
#pragma once

#include <Eigen/Dense>

#include "cost_functions/models/kinematic_model.h"
#include "problems/common/random.h"
#include "problems/log/flight_log.h"
#include "problems/vgd/flight_data.h"

namespace trueline::testing_ekf {

// A flight that never turns: attitude is the identity, specific force in x, y is smooth, and so
// everything is linear in p, v and b_a. Passes of 1.2 s with fixes, arcs of 1 s without.
inline FlightLog UnturnedFlight(std::uint64_t seed, const Eigen::Vector3d& accel_bias) {
  constexpr double kRate = 100.0, kDuration = 9.0, kGravity = 9.81;
  Random random(seed, "unturned");
  FlightLog log;
  log.gravity = kGravity;
  KinematicState<double> x;
  x.v = Eigen::Vector3d(1.5, -0.3, 0.1);
  for (int k = 0; k <= static_cast<int>(kDuration * kRate); ++k) {
    const double t = k / kRate;
    const auto force = [&](double s) {
      return Eigen::Vector3d(0.8 * std::sin(1.1 * s), 0.6 * std::cos(0.7 * s), -kGravity);
    };
    log.imu.push_back({FromSeconds(t), force(t) + accel_bias, Eigen::Vector3d::Zero()});
    log.attitude.push_back({FromSeconds(t), Eigen::Quaterniond::Identity()});
    log.mocap.push_back({FromSeconds(t), x.p, x.q_E_I});
    if (k % 7 == 0 && std::fmod(t, 2.2) < 1.2) {
      const double sigma = random.Uniform(0.05, 0.2);
      log.fixes.push_back({FromSeconds(t), x.p + sigma * random.NormalVector3(), sigma, 0});
    }
    const ImuInput input{0.5 * (force(t) + force(t + 1.0 / kRate)), Eigen::Vector3d::Zero()};
    KinematicStep(input, ImuBias<double>(), kGravity, 1.0 / kRate, &x);
  }
  return log;
}

inline FlightData LinearDataOf(const FlightLog& log) {
  return FlightData(log, DriveOptions(), PassOptions(), DragMeasurementOptions());
}

}  // namespace trueline::testing_ekf
