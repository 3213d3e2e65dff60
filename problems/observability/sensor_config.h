// Sensors of the rotor-driven model, from YAML (config/observe/, config/design/).
#pragma once

#include <string>
#include <vector>

#include "problems/common/yaml_archive.h"
#include "problems/log/flight_log.h"
#include "problems/observability/rotor_driven_system.h"

namespace trueline {

// Rates [Hz] and sigmas of one sample; every key has a default (those of Wuest et al.).
void Serialize(YamlArchive* a, SensorSet* s);
// Names out of imu, position, pose.
SensorSet WithSensors(SensorSet noise, const std::vector<std::string>& names, const YamlMap& map,
                      const std::string& key);

// Rates as logged; sigmas as for the paper's sensors, but for fixes, which state theirs.
SensorSet SensorsOf(const FlightLog& log);

}  // namespace trueline
