// A model.yaml that was fitted to a flight is no prior knowledge about that flight.
#pragma once

#include <string>

#include "problems/log/flight_log.h"

namespace trueline {

// True if model.yaml states that this recording was fitted (provenance: the digest of imu.csv).
bool IsFittedTo(const std::string& model_file, const FlightLog& log);

// What to tell the user where the model's constants are left out for that reason.
std::string OwnModelWarning(const std::string& model_file);

}  // namespace trueline
