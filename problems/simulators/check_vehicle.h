// What a simulator's file can be told from itself, without any flight.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "problems/simulators/flight_estimate.h"
#include "problems/simulators/vehicle_file.h"

namespace trueline {

// k_m over k_f (m) of propellers: those of 5 to 40 cm have 0.003 to 0.04, PX4's Iris 0.06.
inline constexpr double kLeastMoment = 0.003, kMostMoment = 0.07;

inline constexpr const char* kNotPositive = "must be positive";  // text of a finding

// A number that is wrong.
struct Contradicted {
  std::string parameter, unit;
  double file_value = 0.0;  // in Trueline's units
  // What is wrong: the range and its source, the factor, a unit that explains it.
  std::string text;
  std::string file, key;  // the place; empty key: none
  int line = 0;
  std::optional<double> flight_value = {};  // none: the file contradicts itself
  double sigma = 0.0;                       // of flight_value, and of what is known of a log's
  std::optional<ErrorByHorizon> cost = {};  // m, more of position error with the file's value
  std::vector<std::string> confused_with = {};
};

// Whether one of the entries is of the parameter.
template <class Entry>
bool Names(const std::vector<Entry>& entries, const std::string& parameter) {
  return std::ranges::find(entries, parameter, &Entry::parameter) != entries.end();
}

// The place of a reading in its file; null: the file alone.
void Place(const VehicleFile& file, const Reading* at, Contradicted* entry);

// Of one vehicle: inertia that no body has, hover outside of the motors' range, ratios that no
// vehicle of that size has, a number in the wrong unit, rotor order against spins, numbers that the
// file repeats and that differ.
std::vector<Contradicted> CheckVehicle(const VehicleFile& file);
// The first of the numbers that no vehicle has at zero or below, which leave nothing to compare.
std::optional<Contradicted> NotPositive(const VehicleFile& file);
// What is wrong with moments of inertia: the parameter and why no body has it.
std::vector<std::pair<std::string, std::string>> ImpossibleInertia(const NeutralVehicle& vehicle);
// Numbers of vehicles of one name (or of no name) that differ.
std::vector<Contradicted> CompareVehicles(const std::vector<VehicleFile>& files);

}  // namespace trueline
