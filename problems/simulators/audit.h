// An audit: what a simulator's file, or a log flown in it, gets wrong of a vehicle, and what that
// costs in prediction.
#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "problems/simulators/flight_estimate.h"
#include "problems/simulators/vehicle_file.h"

namespace trueline {

// What a simulator's file can be told from itself, without any flight.

// k_m over k_f (m) of propellers: those of 5 to 40 cm have 0.003 to 0.04, PX4's Iris 0.06.
inline constexpr double kLeastMoment = 0.003, kMostMoment = 0.07;

inline constexpr const char* kNotPositive = "must be positive";  // text of a finding

// A number that is wrong.
struct Contradicted {
  std::string parameter, unit;
  double file_value = 0.0;  // in Trueline's units
  // What is wrong: the range and its source, the factor, a unit that explains it.
  std::string text = {};
  std::string file = {}, key = {};  // the place; empty key: none
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

struct NotJudged {
  std::string parameter, fly;
};

// What the vehicle has and the file states nothing of.
struct Lack {
  std::string effect, text;
};

// A parameter that the flight judges: for the page.
struct Compared {
  std::string parameter, unit;
  double file_value, flight_value, sigma;
  double tolerance;  // what vehicles of one kind differ by anyway
  bool contradicted;
  // m, more of position error with the file's value, where the flight shows another within the
  // tolerance. None: it shows none, or that costs nothing.
  std::optional<ErrorByHorizon> cost = {};
};

struct Audit {
  std::vector<Contradicted> contradicted;  // those that cost most first
  std::vector<NotJudged> not_judged;
  std::vector<Lack> lacks;
  std::vector<Compared> compared;
  // Position errors on held-out flight (m): of the file, of the corrected one, of the flight's own
  // vehicle. None without a log.
  std::optional<ErrorByHorizon> before, after, best;
  std::vector<std::pair<std::string, std::string>> corrected;  // file name, text
  std::vector<std::string> warnings;
  std::string simulator;
  std::vector<std::string> logs;
};

// Of files alone.
Audit AuditFiles(const std::vector<VehicleFile>& files);
// Of the first of `files` by flights of the vehicle. The log's mass, as log.yaml states it, is
// taken as weighed; without one the file's is.
Audit AuditByFlights(const std::vector<VehicleFile>& files, const std::vector<FlightLog>& logs);
// Of a log flown in the simulator by flights of the vehicle; no file is needed.
Audit AuditLogs(const FlightLog& simulated, const std::vector<FlightLog>& logs);

// What an audit finds, in words and as files: units, factors, and what to fly.

// Of a parameter that files and flights are compared by; empty: none.
std::string UnitOf(const std::string& parameter);
// "14.4 times too small", with a mistake of units that makes such a factor. Empty where one is 0.
std::string RatioInWords(double file, double flight);
// What to fly and log so that a flight judges the parameter, without what `log` has.
NotJudged NotShown(const std::string& parameter, const FlightLog& log);

// "0.123 m", "diverges" where it is infinite, "no prediction" where the flight is too short for
// one.
std::string ErrorInWords(double error);

// Adds what the flights show clearly and the simulator has nothing of.
void AddLacks(const std::map<std::string, FlightValue>& values, bool has_drag, bool has_lag,
              Audit* audit);

// audit.yaml and the corrected files.
void WriteAudit(const Audit& audit, const std::filesystem::path& directory);
// For standard output.
std::string AuditTable(const Audit& audit);

}  // namespace trueline
