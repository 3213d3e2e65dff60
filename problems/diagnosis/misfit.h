// The misfit taken apart: how the error of the simulation grows when the measured flight is
// replayed open loop with constant parameters, and what that error goes with.
#pragma once

#include <string>
#include <vector>

#include "problems/diagnosis/search.h"

namespace trueline {

// One replay: from the fitted state at a knot, without correction, for `horizon` seconds.
struct ReplayError {
  int segment;  // of the plan, where it starts
  double horizon;
  TimeNs end;
  Eigen::Vector3d error_E;  // m, simulated less measured displacement
  Eigen::Vector3d error_B;  // m, in body axes at the end
};

// What a replay may go with, at its middle.
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

// Share of the variance of the horizontal error that a quantity explains (one-way analysis of
// variance over bins, less what chance explains), and the probability of as much by chance.
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

// Replays of kReplay seconds from some segments, with a model that a part of the flight gave;
// `corrected` is the log that goes with its effects.
inline constexpr double kReplay = 1.0;
std::vector<ReplayError> ReplayPart(const CauseSearch& search, const FlightLog& log,
                                    const FlightLog& corrected, const DriveOptions& drive,
                                    const PartFit& fit, const std::vector<int>& segments);

// `before` and `after` (the latter empty where no cause was found) come from searches over `log`.
Misfit TakeApart(const FlightLog& log, CauseSearch* search, const std::vector<ReplayError>& before,
                 const std::vector<ReplayError>& after);

}  // namespace trueline
