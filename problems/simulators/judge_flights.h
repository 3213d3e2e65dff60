// A stated vehicle against what flights show: which numbers they contradict, and at what cost.
#pragma once

#include <string>
#include <vector>

#include "problems/simulators/audit.h"

namespace trueline {

inline constexpr double kThreshold = 3.5;  // sigmas: over ten parameters one in 2,000 by chance
// A scatter of few pieces is known roughly: what makes kThreshold of its sigmas as rare.
double TailsOf(int dof);

// What vehicles of one kind, or one vehicle on two days, differ by in a parameter, at `value`.
// `arm` (m): mean distance of the rotors. 0: nothing.
double Tolerance(const std::string& parameter, double value, double arm);

// `vehicle` with a parameter at another value.
NeutralVehicle With(NeutralVehicle vehicle, const std::string& parameter, double value);

// m, of the flights' held-out parts, each replayed with its own of `vehicles`.
ErrorByHorizon MeanErrors(const std::vector<FlightEstimate>& flights,
                          const std::vector<NeutralVehicle>& vehicles);

struct FlightJudge {
  Audit* audit;
  const std::vector<FlightEstimate>& flights;
  double arm;
  const FlightLog& log;  // advice leaves out what it has

  // Of the vehicle's number, of which a flight shows one day's.
  double Sigma(const std::string& parameter, const FlightValue& value) const;
  bool Differs(const std::string& parameter, double stated, const FlightValue& value) const;
  // True if contradicted. `file`, `at`: where it is stated; null: nowhere.
  bool Compare(const std::string& parameter, double stated, const FlightValue& value,
               const VehicleFile* file, const Reading* at) const;
  // What each number that differs costs in prediction; the dearest that is contradicted first.
  void AddCosts() const;

 private:
  // None for what no replay sees.
  std::optional<ErrorByHorizon> CostOf(const std::string& parameter, double stated,
                                       double shown) const;
};

}  // namespace trueline
