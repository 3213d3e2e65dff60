// Flights of the independent replays, and logs of them.
#pragma once

#include <algorithm>
#include <cmath>

#include "problems/common/random.h"
#include "problems/log/flight_log.h"
#include "tests/simulators/independent_replay.h"
#include "tests/simulators/made_vehicle.h"

namespace trueline {

inline constexpr double kShakySeconds = 25.0;

// A pilot of a simulator's vehicle: he follows a figure by thrust and attitude, and shakes the
// vehicle about all axes.
class ShakyPilot {
 public:
  ShakyPilot(const NeutralVehicle& vehicle, std::uint64_t seed) : v_(vehicle) {
    Random random(seed, "pilot");
    for (Eigen::Vector3d* phases : {&place_, &shake_[0], &shake_[1], &shake_[2]}) {
      for (double& phase : *phases) phase = random.Uniform(0.0, 2.0 * M_PI);
    }
    const int n = static_cast<int>(v_.rotors.size());
    Eigen::MatrixXd mix(4, n);
    for (int i = 0; i < n; ++i) {
      const double k_f = v_.Get("k_f", i);
      // Forward-left-up: y_M is to the right, and a spin of +1 turns the body to the left.
      mix.col(i) << k_f, -v_.Get("y_M", i) * k_f, -v_.Get("x_M", i) * k_f, v_.Get("spin_k_m", i);
    }
    unmix_ = mix.completeOrthogonalDecomposition().pseudoInverse();
  }

  std::vector<double> operator()(double t, const replay::State& s) const {
    const Eigen::Vector3d rate(1.3, 1.7, 1.1), size(1.6, 1.2, 0.5);  // rad/s, m
    Eigen::Vector3d p, v, a;
    for (int k = 0; k < 3; ++k) {
      const double phase = rate[k] * t + place_[k];
      p[k] = size[k] * (std::sin(phase) - std::sin(place_[k]));
      v[k] = size[k] * rate[k] * std::cos(phase);
      a[k] = -size[k] * rate[k] * rate[k] * std::sin(phase);
    }
    const Eigen::Vector3d force = v_.Get("m") * (a + 4.0 * (v - s.v) + 4.0 * (p - s.p) +
                                                 v_.gravity * Eigen::Vector3d::UnitZ());
    const Eigen::Matrix3d R = s.q.toRotationMatrix();
    Eigen::Matrix3d wanted;
    const Eigen::Vector3d up = force.normalized();
    const Eigen::Vector3d left = up.cross(Eigen::Vector3d::UnitX()).normalized();
    wanted << left.cross(up), left, up;
    const Eigen::Matrix3d off = 0.5 * (wanted.transpose() * R - R.transpose() * wanted);
    Eigen::Vector3d turn = -60.0 * Eigen::Vector3d(off(2, 1), off(0, 2), off(1, 0)) - 10.0 * s.w;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d often(5.0 + k, 11.0 + 2.0 * k, 17.0 - k);  // rad/s
      for (int j = 0; j < 3; ++j) {
        turn[k] += (k == 2 ? 2.0 : 10.0) * std::sin(often[j] * t + shake_[k][j]);
      }
    }
    Eigen::Vector4d asked;
    asked << std::max(0.2 * v_.Get("m") * v_.gravity, force.dot(R.col(2))),
        v_.Get("I_x") * turn.x(), v_.Get("I_y") * turn.y(), v_.Get("I_z") * turn.z();
    std::vector<double> speeds;
    for (const double square : (unmix_ * asked).eval()) {
      speeds.push_back(std::sqrt(std::clamp(square, 1e5, 2200.0 * 2200.0)));
    }
    return speeds;
  }

 private:
  NeutralVehicle v_;
  Eigen::Vector3d place_;
  Eigen::Vector3d shake_[3];
  Eigen::MatrixXd unmix_;
};

// What sensors see, at 100 Hz, of a flight whose actuators are rotor speeds.
inline FlightLog LogOf(const replay::Flight& flight, const NeutralVehicle& vehicle,
                       std::uint64_t seed) {
  constexpr double kAccel = 0.25, kGyro = 0.0125, kPosition = 0.003, kAttitude = 0.005;
  Random random(seed, "sensors");
  const auto noise = [&](double sigma) -> Eigen::Vector3d {
    return sigma * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
  };
  const auto turned = [](const Eigen::Vector3d& v) {
    return Eigen::Vector3d(v.x(), -v.y(), -v.z());
  };
  const Eigen::Vector3d bias_a = noise(0.2), bias_w = noise(0.02);
  FlightLog log;
  log.directory = "flight", log.gravity = vehicle.gravity;
  for (std::size_t i = 0; i < flight.states.size(); i += 10) {
    const replay::State& s = flight.states[i];
    const TimeNs t = static_cast<TimeNs>(i) * 1'000'000;
    log.imu.push_back(
        {t, turned(flight.force[i]) + bias_a + noise(kAccel), turned(s.w) + bias_w + noise(kGyro)});
    log.rotors.push_back({t, flight.actuators[i]});
    if (i % 20 != 0) continue;
    const Eigen::Vector3d small = 0.5 * noise(kAttitude);
    const Eigen::Quaterniond q(s.q.w(), s.q.x(), -s.q.y(), -s.q.z());
    log.pose.push_back(
        {t, turned(s.p) + noise(kPosition),
         (q * Eigen::Quaterniond(1.0, small.x(), small.y(), small.z())).normalized()});
  }
  log.vehicle.emplace().mass = vehicle.Get("m");
  return log;
}

}  // namespace trueline
