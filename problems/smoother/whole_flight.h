// The batch smoother: whole flights of one vehicle solved at once, with drifting errors.
#pragma once

#include <limits>
#include <set>
#include <string>
#include <vector>

#include "problems/result/estimate.h"
#include "problems/smoother/smoother.h"
#include "problems/vgd/flight_data.h"

namespace trueline {

// A flight with its learned process and held parameters; it must outlive the problem.
struct FlightShare {
  const FlightData* flight;
  std::set<int> false_passes;                    // indices of passes whose fixes do not count
  int passes = std::numeric_limits<int>::max();  // use the first so many passes
};

struct WholeFlightOptions {
  // Learns the strengths of the AHRS drift, of unmodelled accelerations and of gusts by maximum
  // marginal likelihood, starting at `process`.
  bool learn_strengths = true;
  // Does not fit drag along an axis whose velocity hardly changes (DragErrors::ShowsDrag).
  bool withhold_drag = true;
  double learn_time = 120.0;  // s, from each flight's start, for learning strengths
};

// A learned value other than the parameters, with its 95 % interval.
struct LearnedStrength {
  std::string name;
  double value;
  double lower, upper;
  std::string unit;
};

struct WholeFlight {
  int flights = 0;
  int passes = 0;
  double seconds = 0.0;  // of flight
  // Means over the flights; AHRS errors include their drift.
  std::vector<ParameterEstimate> parameters;
  std::vector<std::string> unobservable;
  // Parameters left out and flights that would show them; a search for strengths that did not
  // converge.
  std::vector<std::string> notes;
  std::vector<LearnedStrength> strengths;
  std::vector<TrajectoryPoint> trajectory;  // smoothed, at fixes, knots and force samples
  int iterations = 0;
  bool converged = false;
  double solve_time = 0.0;  // s, of the last solve
};

void Serialize(YamlArchive* a, WholeFlightOptions* o);

// Throws InputError without vgd.process, or if a flight has no pass.
WholeFlight RunWholeFlight(const std::vector<FlightShare>& flights, const VgdOptions& vgd,
                           const SmootherOptions& walks, const WholeFlightOptions& options);

}  // namespace trueline
