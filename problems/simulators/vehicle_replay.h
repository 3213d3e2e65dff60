// A vehicle flown from a state by its rotors' speeds alone, with the estimators' own equations.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/rotor/rotor_state.h"
#include "problems/simulators/neutral_vehicle.h"

namespace trueline {

struct Replay {
  std::vector<double> t;            // s
  std::vector<MovingState> states;  // kMoving numbers of RotorDrivenModel
};

// Speeds of the rotors (rad/s) at a time (s).
using SpeedsAt = std::function<std::vector<double>(double t)>;

// What flies: equations, constants and the motors' lag.
struct FlyingVehicle {
  RotorAeroModel model;
  RotorConstants constants;
  double tau = 0.0;  // s, of the rotors behind commands; 0: at once
};
FlyingVehicle Flying(const NeutralVehicle& vehicle);
// The vehicle of a model.yaml, with all that the model states, or of one of a simulator's files.
// Throws InputError where that has no mass, inertia or rotors.
FlyingVehicle ReadFlying(const std::string& path);

// The states at `times` (s, ascending), from `start` at the first of them.
Replay Fly(const FlyingVehicle& vehicle, const MovingState& start, const SpeedsAt& speeds,
           const std::vector<double>& times);

// The states that a flight measures: poses, differences of positions, gyroscope. `constants` say
// where the sensors sit and how they err. Throws InputError for a log without poses, IMU or rotor
// speeds.
struct MeasuredFlight {
  Replay states;                            // by the log's clock
  std::vector<double> speed_times;          // s, likewise
  std::vector<std::vector<double>> speeds;  // rad/s, by time, then rotor
};
MeasuredFlight MeasuredStates(const FlightLog& log, int rotors, const RotorConstants& constants);

// Level flight at `speed` (m/s, forward; a third of it to the right), from which the vehicle rolls,
// pitches and yaws by pulses of its commands.
Replay FlyPulses(const NeutralVehicle& vehicle, double speed, double seconds);
// The commands (rad/s) of that flight at `t`, by rotor.
std::vector<double> PulsesAt(const NeutralVehicle& vehicle, double t);
// m, between the ends of both vehicles' flights of `seconds` by the commands of `a`.
double Apart(const NeutralVehicle& a, const NeutralVehicle& b, double speed, double seconds);

}  // namespace trueline
