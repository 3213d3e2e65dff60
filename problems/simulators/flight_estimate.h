// What a flight says of a vehicle: its parameters with sigmas, whatever a simulator's file says.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/simulators/neutral_vehicle.h"

namespace trueline {

inline constexpr double kUsualYawInertia = 0.93;  // I_z over I_x + I_y of quadrotors

inline constexpr std::array<double, 3> kHorizons = {0.25, 0.5, 1.0};  // s
// m, mean position error of predictions on held-out flight, by horizon.
using ErrorByHorizon = std::array<double, kHorizons.size()>;

struct FlightValue {
  double value = 0.0, sigma = 0.0;
  bool shown = false;  // false: the flight does not tell it from others, or not at all
  // Of a term (flight_terms.h): what a unit of it makes in this flight, root mean square, m/s^2 or
  // (a moment) rad/s^2. 0: of no term.
  double size = 0.0;
  bool moment = false;
};

struct FlightEstimate {
  NeutralVehicle vehicle;  // with all that the flight shows; what it does not, as it was given
  std::map<std::string, FlightValue> values;  // by name of NeutralInfo
  std::vector<std::string> warnings;

  // True if the flight shows the parameter, or (I_z) its ratio to another.
  bool Judges(const std::string& name) const;
  // Replays the held-out part of the flight with another vehicle; what the flight shows of sensors
  // and air moments, and parameters that it does not judge, stay as fitted.
  ErrorByHorizon ErrorsWith(const NeutralVehicle& other) const;

  // Of the fit, for ErrorsWith.
  RotorConstants constants = RotorConstants::Zero();
  double fitted_moment = 0.0;  // N m s^2, k_m
  RotorNoise noise;
  RotorData held_out;
};

// Fits the vehicle to the flight, from `start`, whose rotors are in the order of the log's columns;
// sigmas of the priors are wide. Mass and I_z are held: a flight shows k_f / m and k_m / I_z only.
// Throws InputError for a log without rotor speeds or commands, IMU or poses.
FlightEstimate EstimateFromFlight(const FlightLog& log, const NeutralVehicle& start);

// The rotors of `vehicle`, numbered from 0, in the order of the log's columns: by their places as
// log.yaml states them; where it states none, by the turns that each of them makes.
std::vector<int> LogOrder(const NeutralVehicle& vehicle, const FlightLog& log);
NeutralVehicle InLogOrder(const NeutralVehicle& vehicle, const FlightLog& log);

// The vehicle of a log alone: mass and rotors as log.yaml states them, inertia by the flight from a
// guess. Throws InputError where log.yaml states none.
NeutralVehicle VehicleOfLog(const FlightLog& log);

// Of several flights: means by their sigmas, widened where the flights scatter more.
std::map<std::string, FlightValue> Together(const std::vector<FlightEstimate>& flights);

}  // namespace trueline
