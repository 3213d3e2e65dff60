// The map for a log when none is given.
#pragma once

#include <yaml-cpp/yaml.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/import/convert.h"
#include "problems/import/formats/recording.h"
#include "problems/import/import_map.h"
#include "problems/log/flight_log.h"

namespace trueline {

// Of the maps that ship, the one for this log's format of which it has the most streams; none if it
// has the IMU of none. A CSV file fits a map that finds every column by its name.
std::optional<ImportMap> FindShippedMap(const Recording& recording);

// A log with the map that reads it: one that ships, or a proposal.
struct FoundLog {
  std::vector<std::string> files;  // of the map's inputs
  std::unique_ptr<Recording> recording;
  std::optional<ImportMap> shipped;
  std::string map;  // YAML
  // What a proposal assumes, a line each; of a map that ships, what the log showed otherwise.
  std::vector<std::string> assumed;
};

// `files` are one log of any format, or tables of one log, or a folder of these.
FoundLog FindLog(const std::vector<std::string>& files);

// The map. Throws NoUsableLog, with what is missing, for a proposal that reads no log.
ImportMap MapOf(const FoundLog& found);

// Whether all files are text that holds a table.
bool AreTables(const FoundLog& found);

// A line for each input and stream of a map, and one for its axes.
std::vector<std::string> AssumptionsOf(const YAML::Node& map);

// What to say of a log that was read by a proposal.
std::vector<std::string> AssumptionWarnings(const FoundLog& found);

// The log, converted by its map. Throws NoUsableLog, with what is missing, where none can be made.
FlightLog ConvertFound(const FoundLog& found, const ConvertOptions& options);

// The user's map of these files. Where it reads no position, and the names of the columns show one
// or a velocity, that is read too, and `warnings` says so. `node` gets the map as YAML.
ImportMap ReadUserMap(const std::string& path, const std::vector<std::string>& files,
                      std::vector<std::string>* warnings, YAML::Node* node);

// A map to edit, as YAML: channels and columns by the names of their fields; axes and units that no
// name states by the size of the numbers, as comments say.
std::string ProposeMap(Recording* recording);

// Whether the mean specific force is far from the body's -z, so that another axis points up. True
// of a log without an IMU.
bool HasOtherUp(const FlightLog& log);

// A log of commands without an IMU.
bool HasCommandsAlone(const FlightLog& log);

// Why FindShippedMap() found none, as the end of a sentence about the file.
std::string WhyNoMapFits(Recording* recording);

// What a log made by a map that nobody has checked lacks for a calibration, and what to do about
// it. Throws NoUsableLog for what no calibration can do without; `file` is the foreign log.
std::vector<std::string> Shortcomings(const FlightLog& log, const std::string& file);
std::string NoPositions(const std::string& file);  // what is said of one

}  // namespace trueline
