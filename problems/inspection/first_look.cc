#include "problems/inspection/first_look.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "problems/common/error.h"
#include "problems/import/convert.h"
#include "problems/import/find_map.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/excerpt.h"
#include "problems/inspection/settle_proposal.h"
#include "problems/inspection/stuck.h"
#include "problems/log/native_log.h"

namespace trueline {
namespace {

// Of a long log, cover by the whole and all else by its middle.
std::vector<Finding> FindingsOf(const FlightLog& log) {
  const std::optional<FlightLog> middle = MiddleOfLong(log);
  return Inspect(middle ? *middle : log, {}, &log).findings;
}

// A single spike of the IMU moves one window's bias; that of a rotor is a large moment that the
// vehicle never felt. The other faults last for the whole flight.
bool MakesWrong(const Finding& finding) {
  return finding.Biases() && (finding.kind != &fault::kSpikes || finding.stream != "imu");
}

// Whether a fit by this drive may read the stream. Which of pose.csv and mocap.csv the rotors' fit
// reads is the configuration's choice.
bool MayRead(ForDrive drive, const std::string& stream) {
  const auto is_one_of = [&](const auto&... names) { return ((stream == names) || ...); };
  switch (drive) {
    case ForDrive::kImu:
      return !is_one_of("rotors", "motors", "pose");
    case ForDrive::kRotors:
      return !is_one_of("attitude", "fixes");
    case ForDrive::kAny:
    case ForDrive::kCommands:
      break;
  }
  return true;
}

std::vector<Finding> FindingsForAll(const FlightLog& log, ForDrive drive) {
  std::vector<Finding> findings = FindingsOf(log);
  std::erase_if(findings, [&](const Finding& finding) {
    const auto is_warned = finding.kind->is_warned;
    return !MayRead(drive, finding.stream) ||
           !(finding.level == Level::kFatal || (is_warned != nullptr && is_warned(finding)));
  });
  if (drive == ForDrive::kAny) return findings;
  std::erase_if(findings, [](const Finding& f) { return f.kind == &fault::kAttitudeMissing; });
  const auto missing = drive == ForDrive::kImu ? MissingAttitude(log) : std::nullopt;
  if (missing) findings.push_back(*missing);
  return findings;
}

std::string WarningOf(const Finding& finding) {
  return fmt::format("{} ({}): {}. Nothing is corrected; {}. trueline inspect {}", finding.kind->id,
                     NameOf(finding.level), finding.text, finding.remedy,
                     finding.repaired ? "writes the corrected map" : "tells more");
}

}  // namespace

FlightLog ReadAndLook(const std::filesystem::path& directory, std::vector<LogFault>* faults,
                      ForDrive drive, const std::string& map) {
  FlightLog log = ReadAnyLog(directory.string(), map);
  if (log.imu.empty() && drive != ForDrive::kCommands) {
    throw ErrorAt((directory / "imu.csv").string(), 0,
                  "is missing; every log needs it, but for trueline diagnose --against");
  }
  if (drive != ForDrive::kRotors && !HasPositions(log)) {
    if (!IsNativeLog(directory)) {
      throw NoUsableLog(NoPositions(directory.string()) + kWithoutPositions);
    }
    RequirePositions(log, directory.string());
  }
  for (const std::string& warning : LeaveOutLostTracks(&log)) log.warnings.push_back(warning);
  for (const std::string& warning : FirstLook(log, drive, faults)) log.warnings.push_back(warning);
  return log;
}

std::vector<std::string> FirstLook(const FlightLog& log, ForDrive drive,
                                   std::vector<LogFault>* faults) {
  std::vector<std::string> warnings;
  for (const Finding& finding : FindingsForAll(log, drive)) {
    warnings.push_back(WarningOf(finding));
    if (faults == nullptr || !MakesWrong(finding)) continue;
    faults->push_back({log.directory, finding.kind, finding.stream, finding.size,
                       finding.level == Level::kFatal,
                       fmt::format("{}: {}", finding.kind->id, finding.text)});
  }
  return warnings;
}

std::vector<FlightLog> ReadFlights(const std::vector<std::string>& directories,
                                   std::vector<LogFault>* faults, ForDrive drive,
                                   const std::string& map) {
  std::vector<FlightLog> logs;
  std::vector<Fingerprint> fingerprints;  // of `logs`
  for (const std::string& directory : directories) {
    FlightLog log = ReadAndLook(directory, faults, drive, map);
    if (directories.size() > 1) fingerprints.push_back(FingerprintOf(log));
    for (std::size_t i = 0; i < logs.size(); ++i) {
      const double shared = SharedRecording(fingerprints.back(), fingerprints[i]);
      if (shared < kHardly) continue;
      throw ErrorAt(directory, 0,
                    fmt::format("is the same recording as {} ({:.0f} % of its samples are the "
                                "same); give each flight once",
                                logs[i].directory, 100.0 * shared));
    }
    logs.push_back(std::move(log));
  }
  return logs;
}

std::vector<std::string> WarningsByFlight(std::span<const FlightLog> logs) {
  std::vector<std::string> warnings;
  for (const FlightLog& log : logs) {
    for (const std::string& warning : log.warnings) {
      const bool has_name = warning.starts_with(log.directory + ":");
      warnings.push_back(has_name ? warning : fmt::format("{}: {}", log.directory, warning));
    }
  }
  return warnings;
}

}  // namespace trueline
