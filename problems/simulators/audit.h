// An audit: what a simulator's file, or a log flown in it, gets wrong of a vehicle, and what that
// costs in prediction.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/simulators/check_vehicle.h"

namespace trueline {

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

}  // namespace trueline
