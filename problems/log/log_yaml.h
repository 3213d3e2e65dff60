// log.yaml of a native log: name, frames, gravity, gates, vehicle, source.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cost_functions/models/rigid_body.h"
#include "problems/common/strict_yaml.h"
#include "problems/log/flight_log.h"

namespace trueline {

// Fills the fields of `log` that are no streams. Throws InputError naming file, line and key.
void ReadLogYaml(const std::filesystem::path& path, FlightLog* log);

std::string LogYaml(const FlightLog& log);  // the file's text

// The `vehicle` and `gates` sections, as other configurations have them too.
Vehicle ReadVehicle(const YamlMap& map);
// The key `environment`: indoors, outdoors, or empty if the file does not state it.
std::string ReadEnvironment(const YamlMap& map);
std::vector<Gate> ReadGates(const YamlMap& parent);

// Reads position [m], axis (of any length; up if absent), spin, k_f [N s^2] and k_m [N m s^2] of
// each rotor. Throws InputError for what no rotor has.
std::vector<Rotor> ReadRotors(const std::vector<YamlMap>& rotors);

}  // namespace trueline
