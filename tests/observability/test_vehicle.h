// The vehicle of Wuest et al. 2019, turned from z-up to NED/FRD, as tests use it.
#pragma once

#include <vector>

#include "problems/observability/rotor_driven_system.h"

namespace trueline {

inline RotorDrivenModel TestQuadrotor() {
  const double k_f = 3.8108e-7, k_m = 3.6203e-9;
  std::vector<Rotor> rotors;
  rotors.reserve(4);
  const double signs[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
  for (int i = 0; i < 4; ++i) {
    rotors.push_back({{0.071 * signs[i][0], 0.080 * signs[i][1], 0.0},
                      {0, 0, -1},
                      i % 2 == 0 ? 1 : -1,
                      k_f,
                      k_m});
  }
  return RotorDrivenModel(rotors);
}

inline std::vector<double> TestNominal() {
  using M = RotorDrivenModel;
  std::vector<double> x(M::kStates, 0.0);
  x[0] = 1.0;
  x[M::kMass] = 0.2463;
  const double inertia[] = {0.623e-3, 0.678e-3, 1.076e-3};
  const double centre[] = {0.003, 0.0005, -0.025}, pose[] = {0.04242, -0.01638, 0.0};
  const double imu[] = {-0.01, 0.02, 0.0}, accel[] = {0.1, -0.2, 0.3}, gyro[] = {0.01, 0.02, -0.03};
  for (int i = 0; i < 3; ++i) {
    x[M::kInertia + i] = inertia[i];
    x[M::kCentre + i] = centre[i];
    x[M::kPoseArm + i] = pose[i];
    x[M::kImuArm + i] = imu[i];
    x[M::kAccelBias + i] = accel[i];
    x[M::kGyroBias + i] = gyro[i];
  }
  x[M::kThrustScale] = x[M::kTorqueScale] = 1.0;
  return x;
}

inline SensorSet OnlySensors(bool imu, bool position, bool pose) {
  SensorSet sensors;
  sensors.imu = imu;
  sensors.position = position;
  sensors.pose = pose;
  return sensors;
}

}  // namespace trueline
