// Observability results: exact ones for a kind of motion, numerical ones for one flight.
#pragma once

#include <string>
#include <vector>

#include "problems/observability/assessment.h"
#include "problems/observability/generic_rank.h"
#include "problems/rotor/rotor_vehicle.h"
#include "problems/trajectory/limits.h"
#include "problems/trajectory/rotor_flight.h"

namespace trueline {

// A manoeuvre that would improve the estimate of a state.
struct Advice {
  int state = 0;
  std::string manoeuvre;
  double sigma = 0.0;  // with this manoeuvre added to the flight; the state's unit
};

struct CaseResult {
  std::string name;
  std::string sensors;
  std::string inputs;           // the motion or the flight, in words
  std::vector<StateInfo> info;  // of all error states of the system
  int states = 0;               // numbers of the state vector (a quaternion counts four)
  RankReport rank;

  // Of a flight only (rank.exact is false):
  double duration = 0.0;            // s
  double horizon = 0.0;             // s, over which the motion model is trusted
  std::vector<double> sigma;        // Cramer-Rao with the horizon, by position in rank.states; NaN
                                    // for trajectory states
  std::vector<double> sigma_whole;  // the same without the horizon: the model is exact throughout
  GramianScores scores;             // of the constants that are seen, columns scaled
  std::vector<Advice> advice;
  std::vector<std::string> warnings;
};

struct FlightQuestion {
  std::string name;
  std::string flight;         // in words
  std::vector<int> states;    // error states asked about
  std::vector<double> scale;  // usual standard deviation of each error state; empty: typical sizes
  double horizon = 0.2;       // s, over which the motion model is trusted
  double step = 0.01;         // s, of integration
};

CaseResult ObserveRotorMotion(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                              const std::string& name, const std::vector<int>& states,
                              Motion motion);
CaseResult ObserveImuMotion(const ImuDrivenSystem& system, const std::string& name,
                            const std::vector<int>& states, Turning turning);

// System: RotorDrivenSystem or ImuDrivenSystem.
template <class System>
CaseResult ObserveFlight(const System& system, const NominalFlight& flight,
                         const FlightQuestion& question);

// For each constant that the flight does not show, or shows worst relative to its scale: the simple
// manoeuvre of 10 s within `limits` that reduces its sigma most.
void AdviseRotorFlight(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                       const NominalFlight& flight, const FlightQuestion& question,
                       const FlightLimits& limits, CaseResult* result);

// observability.yaml, and the table for standard output.
std::string ObservabilityYaml(const std::vector<CaseResult>& cases, const std::string& source);

// One block for each case: rank, null space in words and numbers, sigmas, advice.
std::string ObservabilityTable(const std::vector<CaseResult>& cases);
std::string ObservabilityBrief(const std::vector<CaseResult>& cases);  // a line a case

}  // namespace trueline
