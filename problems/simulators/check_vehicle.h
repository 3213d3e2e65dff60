// What a simulator's file can be told from itself, without any flight.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "problems/simulators/vehicle_file.h"

namespace trueline {

// k_m over k_f (m) of propellers: those of 5 to 40 cm have 0.003 to 0.04, PX4's Iris 0.06.
inline constexpr double kLeastMoment = 0.003, kMostMoment = 0.07;

inline constexpr const char* kNotPositive = "must be positive";  // text of a finding

struct FileFinding {
  std::string parameter, unit;
  double value = 0.0;  // of the file, in Trueline's units
  std::string text;    // what is wrong and what would be right, with the source of the range
  std::string file;
  int line = 0;  // 0: no single place
  std::string key;
};

// Of one vehicle: inertia that no body has, hover outside of the motors' range, ratios that no
// vehicle of that size has, a number in the wrong unit, rotor order against spins, numbers that the
// file repeats and that differ.
std::vector<FileFinding> CheckVehicle(const VehicleFile& file);
// The first of the numbers that no vehicle has at zero or below, which leave nothing to compare.
std::optional<FileFinding> NotPositive(const VehicleFile& file);
// What is wrong with moments of inertia: the parameter and why no body has it.
std::vector<std::pair<std::string, std::string>> ImpossibleInertia(const NeutralVehicle& vehicle);
// Numbers of vehicles of one name (or of no name) that differ.
std::vector<FileFinding> CompareVehicles(const std::vector<VehicleFile>& files);

}  // namespace trueline
