// Replays of a flight: simulation without correction from a fitted state.
#pragma once

#include <Eigen/Core>

#include "problems/log/flight_log.h"

namespace trueline {

struct ReplayError {
  int segment;     // of the fit's chain, where it starts
  double horizon;  // s
  TimeNs end;
  Eigen::Vector3d error_E;  // m, simulated less measured displacement
  Eigen::Vector3d error_B;  // m, in body axes at the end
};

// Variables that a replay's error may be correlated with, at the replay's middle.
struct ReplaySituation {
  double time, speed, acceleration, thrust, rate;  // s, m/s, m/s^2, m/s^2, rad/s
  double heading, gate_distance, height, battery;  // rad, m, m, V; NaN where not logged
  int gate;                                        // of the nearest fix within a second; -1: none
  double north, east;                              // m
};

}  // namespace trueline
