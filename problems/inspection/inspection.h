// Finds faults of a log before anything is fitted: in each stream, and between streams.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/inspection/repair.h"
#include "problems/inspection/rotor_layout.h"
#include "problems/inspection/stream_health.h"
#include "problems/inspection/vector_match.h"
#include "problems/log/flight_log.h"

namespace trueline {

// Two streams that were compared; `match` only where the flight shows enough.
struct MotionComparison {
  std::string what;    // "turn rates of mocap against the gyroscope"
  std::string stream;  // the one in question
  std::optional<VectorMatch> match;
  std::string not_shown;  // why there is no match, or why it does not count
};

struct Inspection {
  std::vector<Finding> findings;  // worst first
  std::vector<StreamHealth> streams;
  std::vector<MotionComparison> comparisons;
  std::optional<RotorLayout> rotors;
  Repairs repairs;
  std::vector<std::string> notes;  // what could not be checked, and why
};

// `sources`: see repair.h. Nothing of `log` is changed. `whole`: the log that it is a part of,
// whose streams are to cover each other.
Inspection Inspect(const FlightLog& log, const FileAttitudes& sources,
                   const FlightLog* whole = nullptr);

// `corrected`: the command that converts by the corrected map; empty without one. `log`: what was
// inspected.
std::string InspectionYaml(const Inspection& inspection, const std::string& log,
                           const std::string& corrected);
std::string InspectionTable(const Inspection& inspection);

}  // namespace trueline
