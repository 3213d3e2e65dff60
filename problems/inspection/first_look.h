// What an inspection finds before a calibration or diagnosis, as warnings.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "problems/inspection/fault.h"
#include "problems/log/flight_log.h"

namespace trueline {

// A finding that makes parameters wrong, as results state it.
struct LogFault {
  std::string log;  // its directory
  const FaultKind* kind;
  std::string stream;
  double size;  // in the kind's unit
  bool fatal;
  std::string text;  // "id: what is wrong"
};

// What drives the model: the IMU, which needs an attitude, or the rotors, which do not. Findings of
// streams that the drive does not read are left out: they do not make its results wrong. A
// comparison with other flights reads the commands, too, and does without IMU and attitude.
enum class ForDrive { kImu, kRotors, kAny, kCommands };

// ReadAnyLog, whose warnings also hold FirstLook's findings. `faults`, if given, gets
// those that make parameters wrong. Throws InputError for a log without what the drive needs.
FlightLog ReadAndLook(const std::filesystem::path& directory,
                      std::vector<LogFault>* faults = nullptr, ForDrive drive = ForDrive::kAny,
                      const std::string& map = "");

// ReadAndLook for several flights. Throws InputError where two of them hold one recording, whole or
// a part of it, which would count its data twice and confirm itself.
std::vector<FlightLog> ReadFlights(const std::vector<std::string>& directories,
                                   std::vector<LogFault>* faults, ForDrive drive,
                                   const std::string& map = "");

// The warnings of several flights, each with its directory.
std::vector<std::string> WarningsByFlight(std::span<const FlightLog> logs);

// What Inspect() finds that makes a fit worthless (FaultKind::is_warned), each with its
// remedy; the warnings of ReadAndLook. Of a flight longer than six minutes it inspects the middle
// three, so that it stays cheap beside a calibration.
std::vector<std::string> FirstLook(const FlightLog& log, ForDrive drive = ForDrive::kAny,
                                   std::vector<LogFault>* faults = nullptr);

}  // namespace trueline
