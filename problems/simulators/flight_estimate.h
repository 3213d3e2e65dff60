// What a flight says of a vehicle: its parameters with sigmas, whatever a simulator's file says.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
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
  // Of a term (TermsOf): what a unit of it makes in this flight, root mean square, m/s^2 or
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

// What sums alone show of a flight: thrust and inertia to within some percent, where a fit starts
// from when a file is wrong by a factor; the order of its rotors; and its motors.

struct FirstFit {
  double thrust = 1.0;  // k_f over that of the vehicle
  // By axis: angular acceleration over what the vehicle's rotors and inertia give, and how well
  // both go together (correlation, -1 to 1). Without rotor speeds 1 and 0.
  Eigen::Vector3d turn = Eigen::Vector3d::Ones(), correlation = Eigen::Vector3d::Zero();
};

inline constexpr double kGoesTogether = 0.3;  // correlation that is believed

// Angular acceleration about each axis by the squared speed of each rotor.
Eigen::MatrixX3d TurnBySquares(const NeutralVehicle& v);
// Of a log with measured rotor speeds, in the order of the vehicle's rotors.
FirstFit FitFirst(const FlightLog& log, const NeutralVehicle& vehicle);
// The vehicle's rotors in the order of the log's columns, by the turns that each of them makes: the
// order as it is, unless roll and pitch contradict it and agree with another.
struct RotorOrder {
  std::vector<int> rotors;
  bool shown = false;  // false: roll and pitch tell nothing
};
RotorOrder OrderByFlight(const FlightLog& log, const NeutralVehicle& vehicle);

// Motors whose speeds follow slope u + offset with a lag of first order.
struct MotorResponse {
  double lag, lag_sigma;                // s
  double full_speed, full_speed_sigma;  // rad/s, at u = 1
};
// None where the log lacks either, where commands explain little of the speeds, or
// where parts of the flight show different lags.
std::optional<MotorResponse> FindMotorResponse(const FlightLog& log);

// Forces and moments of a flight, term by term, by sums alone: also those that the fitted model
// lacks. Two logs that are compared show what one of their worlds has and the other has not.

// By name of NeutralInfo. Sigmas come from fits that leave out a sixteenth of the flight each.
// Empty for a log without measured rotor speeds.
std::map<std::string, FlightValue> TermsOf(const FlightLog& log, const FlightEstimate& estimate);

}  // namespace trueline
