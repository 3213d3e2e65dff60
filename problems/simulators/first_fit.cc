#include "problems/simulators/first_fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace trueline {
namespace {

constexpr double kWindow = 0.08;  // s, over which turn rates and moments are compared

// Squared speeds at `t`: of the last sample.
const ChannelsSample& At(const std::vector<ChannelsSample>& samples, TimeNs t) {
  auto next = std::upper_bound(samples.begin(), samples.end(), t,
                               [](TimeNs at, const ChannelsSample& s) { return at < s.t; });
  return next == samples.begin() ? *next : *std::prev(next);
}

// Angular acceleration (rad/s^2) by the rotors, axis by axis.
Eigen::Vector3d TurnBy(const ChannelsSample& sample, const NeutralVehicle& v) {
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < std::min(sample.values.size(), v.rotors.size()); ++i) {
    const int rotor = static_cast<int>(i);
    const double square = sample.values[i] * sample.values[i];
    const double thrust = v.Get("k_f", rotor) * square;
    turn += Eigen::Vector3d(-v.Get("y_M", rotor) * thrust, v.Get("x_M", rotor) * thrust,
                            -v.Get("spin_k_m", rotor) * square);
  }
  return turn.cwiseQuotient(Eigen::Vector3d(v.Get("I_x"), v.Get("I_y"), v.Get("I_z")));
}

// Slope and correlation of y over x, each less its mean.
void Regress(const std::vector<double>& x, const std::vector<double>& y, double* slope,
             double* correlation) {
  const auto n = static_cast<Eigen::Index>(x.size());
  if (n < 10) return;
  const Eigen::Map<const Eigen::ArrayXd> a(x.data(), n), b(y.data(), n);
  const double xy = ((a - a.mean()) * (b - b.mean())).sum();
  const double xx = (a - a.mean()).square().sum(), yy = (b - b.mean()).square().sum();
  if (!(xx > 0.0 && yy > 0.0)) return;
  *slope = xy / xx;
  *correlation = xy / std::sqrt(xx * yy);
}

}  // namespace

FirstFit FitFirst(const FlightLog& log, const NeutralVehicle& vehicle) {
  FirstFit fit;
  if (log.rotors.empty() || log.imu.empty()) return fit;
  double force = 0.0, thrust = 0.0;
  Eigen::Vector3d by_rotors = Eigen::Vector3d::Zero(), rate = Eigen::Vector3d::Zero(),
                  last_rate = Eigen::Vector3d::Zero();
  double length = 0.0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  std::vector<double> x[3], y[3];
  // Mean rates of neighbouring windows differ by the acceleration between their middles: half of
  // what the rotors do in each.
  int count = 0, last_count = 0;
  for (std::size_t i = 1; i < log.imu.size(); ++i) {
    const ImuSample& sample = log.imu[i];
    if (sample.t < log.rotors.front().t || sample.t > log.rotors.back().t) continue;
    const ChannelsSample& speeds = At(log.rotors, sample.t);
    force -= sample.accel.z();
    for (std::size_t r = 0; r < std::min(speeds.values.size(), vehicle.rotors.size()); ++r) {
      thrust += vehicle.Get("k_f", static_cast<int>(r)) * speeds.values[r] * speeds.values[r];
    }
    const double dt = SecondsBetween(log.imu[i - 1].t, sample.t);
    by_rotors += TurnBy(speeds, vehicle) * dt;
    rate += sample.gyro, ++count, length += dt;
    if (length < kWindow) continue;
    if (last_count > 0) {
      const Eigen::Vector3d change = rate / count - last_rate / last_count;
      for (int k = 0; k < 3; ++k) {
        x[k].push_back(0.5 * (by_rotors[k] + before[k]));
        y[k].push_back(change[k]);
      }
    }
    last_rate = rate, last_count = count, before = by_rotors;
    rate.setZero(), by_rotors.setZero(), count = 0, length = 0.0;
  }
  if (thrust > 0.0) fit.thrust = force * vehicle.Get("m") / thrust;
  for (int k = 0; k < 3; ++k) Regress(x[k], y[k], &fit.turn[k], &fit.correlation[k]);
  return fit;
}

}  // namespace trueline
