// Thrust and inertia of a flight to within some percent, by sums alone: where a fit starts from
// when a file is wrong by a factor.
#pragma once

#include <Eigen/Core>

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

}  // namespace trueline
