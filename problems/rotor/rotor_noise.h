// Noise that the rotor-driven estimators assume of sensors and of unmodelled forces.
#pragma once

#include "problems/common/yaml_archive.h"

namespace trueline {

// Sensor sigmas are of one sample. Disturbances are white: under a density n the velocity does a
// random walk of variance n^2 t. The accelerometer measures them too. They represent all unmodelled
// forces and moments.
struct RotorNoise {
  double accel = 2.2;            // m/s^2; 4.84 (m/s^2)^2 in Wuest et al. 2019
  double gyro = 0.1732;          // rad/s; 0.03 (rad/s)^2
  double position = 0.01;        // m
  double attitude = 0.01;        // rad
  double force_density = 0.1;    // m/s^2/sqrt(Hz), specific force, each axis
  double angular_density = 0.5;  // rad/s^2/sqrt(Hz), angular acceleration, each axis
};

void Serialize(YamlArchive* a, RotorNoise* noise);

}  // namespace trueline
