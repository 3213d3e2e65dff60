// A flight in closed loop round a course of gates, and its log.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "problems/log/flight_log.h"
#include "problems/simulation/config.h"
#include "problems/simulation/flight.h"
#include "problems/simulation/simulate_rotor_flight.h"

namespace trueline {

// The true parameters, and statistics of the flight.
struct SimulationTruth {
  SimulationConfig config;
  std::uint64_t seed = 0;
  std::vector<simulation::TruthSample> trajectory;  // the log's time, at the IMU's rate

  Eigen::Vector3d accel_walk_mean = Eigen::Vector3d::Zero();   // m/s^2, of the bias over the log
  Eigen::Vector3d ahrs_error_mean = Eigen::Vector3d::Zero();   // rad, angles Phi_E^E' over the log
  Eigen::Vector3d ahrs_error_sigma = Eigen::Vector3d::Zero();  // rad, their spread over the log
  double tilt_error_rms = 0.0;  // rad, angle between the z axes of E and E'
  double tilt_error_max = 0.0;  // rad
  double path_error_rms = 0.0;  // m, from the course
  double path_error_max = 0.0;  // m
  double speed_mean = 0.0;      // m/s
  double speed_max = 0.0;       // m/s
  double laps = 0.0;            // flown within the log
  int passes = 0;               // times that a gate came into view
};

// Called from time to time with the seconds flown so far.
using SimulationProgress = std::function<void(double)>;

// Flies `config` with noise drawn from `seed`; the same pair gives the same bytes. `truth` may be
// null. Throws InputError if the drone departs from the course.
FlightLog Simulate(const SimulationConfig& config, std::uint64_t seed,
                   SimulationTruth* truth = nullptr, const SimulationProgress& progress = {});

// Variants of a configuration for Monte-Carlo: true parameters drawn from the ranges of its
// `randomise:` section.

// The configuration with each parameter of `randomise` drawn uniformly from its range. Each draw
// depends on the seed and the parameter's name only. Throws InputError for a parameter that acts on
// nothing in this flight, or for a drawn value that means nothing.
SimulationConfig DrawVariant(const SimulationConfig& config, std::uint64_t seed);

// What the configured flight has for effects to act on.
simulation::Actors ActorsOf(const SimulationConfig& config);

// Replaces the configuration's vehicle by that of a model.yaml (trueline-calibrate,
// trueline-diagnose): drag, thrust bias, misalignment, and its effects.
SimulationConfig WithModel(const SimulationConfig& config, const YamlMap& model);

// The parameters that `randomise` accepts, with their values: K_x, b_az, phi_I_B, ... and
// `effect.parameter` for the configured effects.
std::map<std::string, double> TunableValues(const SimulationConfig& config);

// The truth file beside a simulated log, for scoring.

// YAML: the parameters of eq. 16 with value, unit and whether they are constant over the flight,
// the AHRS's error, the effects and forces, statistics of the flight, seed, version, configuration.
std::string TruthYaml(const SimulationTruth& truth, const std::string& config_file);

// The true constants of a rotor-driven flight with units, drag and lag, effects and forces, seed,
// version, configuration.
std::string TruthYaml(const RotorTruth& truth, const RotorSimulation& simulation,
                      std::uint64_t seed, const std::string& config_file);

// DIR.truth.yaml beside the log's directory, never inside it.
std::filesystem::path TruthPath(const std::filesystem::path& log_directory);

}  // namespace trueline
