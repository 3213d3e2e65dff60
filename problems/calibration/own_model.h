// What of a model.yaml (--model) holds for a flight. Constants that were fitted to the flight
// itself are no prior knowledge about it. Effects such as a wind belong to the flight that they
// were found on.
#pragma once

#include <set>
#include <span>
#include <string>
#include <vector>

#include "problems/effects/effect.h"
#include "problems/log/flight_log.h"

namespace trueline {

// True if model.yaml states that this recording was fitted, alone or with others (provenance: the
// digests of imu.csv).
bool IsFittedTo(const std::string& model_file, const FlightLog& log);

// What to tell the user where the model's constants are left out for that reason.
std::string OwnModelWarning(const std::string& model_file);

// Takes the effects of one flight out of the model's `effects`, unless the model was fitted to all
// of `logs` or does not state what it was fitted to. Returns the names of constants that these
// effects changed, of which the model states the value before. A warning names both.
std::set<std::string> LeaveOutOtherFlights(const std::string& model_file,
                                           std::span<const FlightLog> logs,
                                           std::vector<Effect>* effects,
                                           std::vector<std::string>* warnings);

}  // namespace trueline
