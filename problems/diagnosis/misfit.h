// Analysis of the misfit: growth of the simulation error when the measured flight is replayed open
// loop with constant parameters, and the variables that this error is correlated with.
#pragma once

#include <string>
#include <vector>

#include "problems/diagnosis/search.h"

namespace trueline {

// One replay: simulation without correction for `horizon` seconds from the fitted state at a knot.
struct ReplayError {
  int segment;  // of the plan, where it starts
  double horizon;
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

struct MisfitRow {
  ReplayError before, after;
  ReplaySituation at;
};

// RMS over all replays of one length, m.
struct MisfitGrowth {
  double horizon;  // s
  int replays;
  Eigen::Vector3d before_E, after_E, before_B, after_B;
};

// Share of the variance of the horizontal error that a variable explains (one-way analysis of
// variance over bins, less the share expected by chance), and its p-value.
struct MisfitShare {
  std::string by;
  double body, earth;  // in body axes, in E
  double p;            // of the larger one
};

struct Misfit {
  bool against_mocap = false;   // else against the fitted path
  double shares_horizon = 1.0;  // s
  std::vector<MisfitRow> rows;
  std::vector<MisfitGrowth> growth;
  std::vector<MisfitShare> shares;  // before; largest first
};

// Replays with the model of the search's last Fit.
std::vector<ReplayError> ReplayOpenLoop(CauseSearch* search, const FlightLog& log);

// Replays of kReplay seconds from some segments, with a model fitted to part of the flight;
// `corrected` is the log corrected by that model's effects.
inline constexpr double kReplay = 1.0;
std::vector<ReplayError> ReplayPart(const CauseSearch& search, const FlightLog& log,
                                    const FlightLog& corrected, const DriveOptions& drive,
                                    const PartFit& fit, const std::vector<int>& segments);

// `before` and `after` (empty if no cause was found) come from searches over `log`.
Misfit TakeApart(const FlightLog& log, CauseSearch* search, const std::vector<ReplayError>& before,
                 const std::vector<ReplayError>& after);

}  // namespace trueline
