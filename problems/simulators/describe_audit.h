// What an audit finds, in words and as files: units, factors, and what to fly.
#pragma once

#include <filesystem>
#include <string>

#include "problems/simulators/audit.h"

namespace trueline {

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
