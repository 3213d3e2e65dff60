// What an audit finds, in words: units, factors, places in files, and what to fly.
#pragma once

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

// The place of a reading in its file; null: the file alone.
void Place(const VehicleFile& file, const Reading* at, Contradicted* entry);

// Adds what the flights show clearly and the simulator has nothing of.
void AddLacks(const std::map<std::string, FlightValue>& values, bool has_drag, bool has_lag,
              Audit* audit);

}  // namespace trueline
