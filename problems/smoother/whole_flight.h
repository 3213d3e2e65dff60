// The batch smoother: whole flights of one vehicle at once, with errors that drift.
#pragma once

#include <string>
#include <vector>

#include "problems/result/estimate.h"
#include "problems/smoother/flight_problem.h"

namespace trueline {

struct WholeFlightOptions {
  // Learns how strongly the AHRS drifts and how large unmodelled accelerations are, by the maximum
  // of the marginal likelihood, starting at `process`.
  bool learn_strengths = true;
  // Leaves drag out of what the accelerometer shows along an axis that the vehicle hardly moves
  // along (DragDoubt::ShowsDrag).
  bool withhold_drag = true;
  double learn_time = 120.0;  // s of each flight, from its start, that strengths are learned from
  // Unknowns beyond the model's, by the sigma of their prior; zero: not asked.
  DetectorUnknowns detector;
  double attitude_latency = 0.0;  // s, of the logged attitude, around drive.attitude_latency
};

// What was learned beside the parameters, with its 95 % interval.
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
  // Means over the flights; AHRS errors with their drift.
  std::vector<ParameterEstimate> parameters;
  std::vector<std::string> unobservable;
  std::vector<std::string> notes;  // what was left out of the fit, and what would show it
  std::vector<LearnedStrength> strengths;
  std::vector<TrajectoryPoint> trajectory;  // smoothed, at fixes, knots and force samples
  int iterations = 0;
  bool converged = false;
  double solve_time = 0.0;  // s, of the last solve
};

WholeFlightOptions ReadWholeFlightOptions(const YamlMap& map);
YAML::Node ToYaml(const WholeFlightOptions& options);

// Needs vgd.process (throws InputError without) and at least one pass in each flight.
WholeFlight RunWholeFlight(const std::vector<FlightShare>& flights, const VgdOptions& vgd,
                           const SmootherOptions& walks, const WholeFlightOptions& options);

}  // namespace trueline
