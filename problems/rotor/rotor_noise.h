// Noise that the rotor-driven estimators assume of sensors and of unmodelled forces.
#pragma once

#include <algorithm>
#include <cmath>

#include "problems/common/yaml_archive.h"

namespace trueline {

// Sensor sigmas are of one sample. Disturbances are white: under a density n the velocity does a
// random walk of variance n^2 t. The accelerometer measures them too. They represent all unmodelled
// forces and moments.
//
// The drift is an unmodelled angular acceleration that lasts: a first-order Gauss-Markov process
// about each axis. An autopilot holds the attitude against it, so the rotors' slow moments cancel
// it. Without this state those moments seem to turn nothing, and the inertia comes out too large.
struct RotorNoise {
  double accel = 2.2;               // m/s^2; 4.84 (m/s^2)^2 in Wuest et al. 2019
  double gyro = 0.1732;             // rad/s; 0.03 (rad/s)^2
  double position = 0.01;           // m
  double attitude = 0.01;           // rad
  double force_density = 0.1;       // m/s^2/sqrt(Hz), specific force, each axis
  double angular_density = 0.5;     // rad/s^2/sqrt(Hz), angular acceleration, each axis
  double angular_drift = 0.0;       // rad/s^2, sigma; 0: none
  double angular_drift_time = 0.5;  // s, time constant

  // The drift's sigma in a fit: without drift a state that is all but held at zero.
  double DriftSigma() const { return std::max(angular_drift, 1e-6); }
  // The share of the drift that is left after dt seconds, and the variance of what came in, of
  // each axis.
  double DriftLeft(double dt) const { return std::exp(-dt / angular_drift_time); }
  double NewDrift(double dt) const {
    return -angular_drift * angular_drift * std::expm1(-2.0 * dt / angular_drift_time);
  }
  bool operator==(const RotorNoise&) const = default;
};

void Serialize(YamlArchive* a, RotorNoise* noise);

}  // namespace trueline
