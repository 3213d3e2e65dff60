// A stated vehicle against what flights show: which numbers they contradict, and at what cost.
#pragma once

#include <functional>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

#include "problems/simulators/audit.h"

namespace trueline {

inline constexpr double kThreshold = 3.5;   // sigmas: over ten parameters one in 2,000 by chance
inline constexpr double kShapeSigma = 0.1;  // relative, of I_z by I_x and I_y of a quadrotor
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
  // The factor by which all of `names` differ alike, stated over shown, so that one other number
  // may explain them, if it explains `others`, too. 1: they do not.
  double OneFactor(const std::vector<std::string>& names, const std::vector<std::string>& others,
                   const std::function<double(const std::string&)>& stated,
                   const std::map<std::string, FlightValue>& values) const;
  // What each number that differs costs in prediction; the dearest that is contradicted first.
  void AddCosts() const;

 private:
  // None for what no replay sees.
  std::optional<ErrorByHorizon> CostOf(const std::string& parameter, double stated,
                                       double shown) const;
};

// Of each log, from `start`; with what it shows term by term, and its warnings in the audit.
std::vector<FlightEstimate> Estimates(const std::vector<FlightLog>& logs,
                                      const NeutralVehicle& start, Audit* audit);
// `names` of `values`, times `factor`.
void ScaleValues(std::initializer_list<const char*> names, double factor,
                 std::map<std::string, FlightValue>* values);

bool StatesRotors(const FlightLog& log, const NeutralVehicle& v);
// m, mean distance of the rotors from their middle.
double ArmOfRotors(const std::vector<Rotor>& rotors);
// A number that the log's description states, too: weighed, or measured with a ruler. True if the
// file's is another.
bool CompareWithLog(const std::string& parameter, double in_file, double stated,
                    const std::string& by, Audit* audit);
void AddSpin(const VehicleFile* file, double spin, const std::string& text, Audit* audit);
// Rotors that turn the other way in log.yaml; `start` gets its spins. `order`: of the file's rotors
// in the log.
void CompareSpins(const VehicleFile* file, const FlightLog& log, const std::vector<int>& order,
                  NeutralVehicle* start, Audit* audit);

// The flights' held-out errors with `vehicle`, whose rotors are in its file's order. Where exactly
// the centre of mass stands is no file's error unless it is named: the proof takes the flight's.
ErrorByHorizon ProofOf(const NeutralVehicle& vehicle, const std::vector<FlightEstimate>& flights,
                       const std::vector<FlightLog>& logs, const Audit& audit);
// A number that is contradicted is judged, by the file if not by the flight.
void JudgeOnce(Audit* audit);

}  // namespace trueline
