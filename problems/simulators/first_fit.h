// What sums alone show of a flight: thrust and inertia to within some percent, where a fit starts
// from when a file is wrong by a factor; the order of its rotors; and its motors.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "problems/log/flight_log.h"
#include "problems/simulators/neutral_vehicle.h"

namespace trueline {

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

}  // namespace trueline
