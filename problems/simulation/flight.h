// The loop of every simulated flight: the drone is flown from one IMU sample to the next.
#pragma once

#include <functional>
#include <optional>

#include "problems/simulation/ahrs.h"
#include "problems/simulation/trajectory.h"

namespace trueline::simulation {

// What acts on the body beside its rotors and the effects.
struct Disturbance {
  Vector3d gust_E = Vector3d::Zero();   // m/s^2, specific force
  Vector3d twist_B = Vector3d::Zero();  // rad/s^2, angular acceleration
};

// What a pilot can use at a sample.
struct Instant {
  int k;         // counts the IMU's samples; negative in the warm-up, which is not logged
  double t, dt;  // s, from the start of the log; since the last sample
  const BodyState& state;
  const BodyRate& rate;
  const ImuReading& reading;
};

// Both are called once for each sample, the air first. What they return is held until the next one.
using Air = std::function<Disturbance(const BodyState&)>;
using Pilot = std::function<RotorArray(const Instant&)>;  // speeds that the rotors approach, rad/s

struct FlightSetup {
  VehicleConfig vehicle;
  ImuConfig imu;
  std::optional<AhrsConfig> ahrs;
  double gravity = 9.81;  // m/s^2
  Stages stages;
  int substeps = 1;  // of the physics between two samples
  int first = 0;     // samples first .. last are flown
  int last = 0;
  std::function<double(int)> time;       // s, of a sample
  std::function<void(double)> progress;  // told the seconds flown from time to time; optional
};

// Flies from `start` and logs the IMU. Noise is drawn from `seed`.
Trajectory RunFlight(const FlightSetup& setup, const BodyState& start, const Air& air,
                     const Pilot& pilot, std::uint64_t seed, FlightLog* log);

}  // namespace trueline::simulation
