// A flight along a trajectory in closed loop, with the independent physics of problems/simulation,
// and its log with rotor speeds, IMU and poses.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "problems/effects/effect.h"
#include "problems/log/flight_log.h"
#include "problems/rotor/rotor_data.h"
#include "problems/rotor/rotor_state.h"
#include "problems/rotor/rotor_vehicle.h"
#include "problems/simulation/config.h"
#include "problems/trajectory/limits.h"

namespace trueline {

struct RotorSimulation {
  explicit RotorSimulation(RotorVehicle flown) : vehicle(std::move(flown)) {}

  RotorVehicle vehicle;     // the true one; biases in its parameters
  RotorNoise noise;         // of sensors, and the white disturbances that really act
  double imu_rate = 250.0;  // Hz, of rotor speeds too
  double pose_rate = 30.0;  // Hz, stamped at the nearest IMU sample (a camera triggered by it)
  // Rotor speeds saturate this share beyond the limits of planned trajectories, which leaves a
  // margin for control.
  FlightLimits limits;
  double control_margin = 0.4;
  double height = 0.0;  // m, of the trajectory's start above the floor (p_z = 0)

  // Beyond the model of Boehm et al. 2020.
  Eigen::Vector3d drag = Eigen::Vector3d::Zero();  // 1/s, K of f_B = K v_B
  double motor_lag = 0.02;                         // s
  double rotor_inertia = 0.0;                      // kg m^2, of each rotor about its axis
  double slow_moments = 0.0;  // rad/s^2, rms of each axis (simulation/forces.h)
  double speed_noise = 0.0;   // share of each speed in rotors.csv, of one sample
  double speeds_late = 0.0;   // s, rotors.csv is stamped after its samples were taken
  double gyro_cutoff = 0.0;   // Hz, of the logged gyroscope's low-pass; 0: none
  bool log_commands = false;  // rotors.csv holds commands, so the lag is unmodelled
  // Rotors driven by motor commands and a battery, with motors.csv and battery.csv; left out:
  // speeds are commanded directly.
  std::optional<simulation::MotorDriveConfig> motors;
  std::optional<simulation::BladeConfig> blades;  // left out: rotors in air at rest
  bool log_rotors = true;                         // false: no rotors.csv
  std::vector<Effect> effects;  // of the catalogue, such as rotor_loss, and terms of `forces`
  std::vector<simulation::UnnamedForce> forces;
};

// States at the times of the IMU samples.
struct RotorTruth {
  RotorConstants constants = RotorConstants::Zero();
  std::vector<MovingState> states;
  double path_error_rms = 0.0;  // m
};

// The constants of the estimators' model that the vehicle flies with. `effects` come on top, except
// that a lag among them replaces the vehicle's. Zero where the simulator lacks the constant.
RotorConstants TrueConstants(const RotorSimulation& config);
// s, of the rotors behind their commands; an effect may have changed it.
double FlownLag(const RotorSimulation& config);

// Throws InputError if the vehicle departs from the trajectory.
FlightLog SimulateRotorFlight(const RotorSimulation& config, const PiecewisePolynomial& path,
                              std::uint64_t seed, RotorTruth* truth = nullptr);

// Keys of an experiment's `simulation`: imu_rate, pose_rate, height, noise, drag, motor_lag,
// rotor_inertia, slow_moments, speed_noise, speeds_late, gyro_cutoff, log_commands, motors, blades,
// log_rotors, effects, forces; vehicle and limits are read elsewhere. Throws InputError naming
// file, line and key.
void ReadRotorSimulation(const YamlMap& map, RotorSimulation* config);

// A rotor-driven flight from its YAML (config/rotors/): vehicle, trajectory, sensors, effects.
struct RotorFlightConfig {
  RotorSimulation simulation;
  PiecewisePolynomial path;
  std::string warning;  // of a path that the vehicle can't follow within its limits; else empty
};

// True if a configuration of trueline-simulate has `trajectory`: it asks for such a flight.
bool IsRotorFlight(const YamlMap& map);
// Keys gravity, vehicle, biases, limits, simulation and trajectory (as trueline-observe). Throws
// InputError naming file, line and key.
RotorFlightConfig ReadRotorFlight(const YamlMap& map);

// Reads gravity, vehicle, biases, limits and simulation; the caller reads the other keys.
RotorSimulation ReadRotorFlightVehicle(const YamlMap& map);

// A simulated flight: the estimators' inputs and the truth that scores them.
struct Flown {
  FlightLog log;
  RotorTruth truth;
  RotorData data;
  std::vector<RotorNode> nodes;  // the truth at each pose
};

// Throws InputError if the vehicle departs from the trajectory.
Flown Fly(const RotorSimulation& simulation, const PiecewisePolynomial& path, std::uint64_t seed);

// The estimators' model: without the simulation's additional effects.
RotorAeroModel ModelOf(const RotorSimulation& simulation);

// A first guess, drawn from `prior` about the true constants and limited to physical bodies.
// Constants that the prior states as known keep its values.
RotorPrior DrawGuess(const RotorPrior& prior, const RotorConstants& truth, std::uint64_t seed);

}  // namespace trueline
