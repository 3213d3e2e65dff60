// Sensors of the rotor-driven model, from YAML (config/observe/, config/design/).
#pragma once

#include <string>
#include <vector>

#include "problems/common/yaml_archive.h"
#include "problems/observability/rotor_driven_system.h"

namespace trueline {

// Rates [Hz] and sigmas of one sample; every key has a default (those of Wuest et al.).
void Serialize(YamlArchive* a, SensorSet* s);
// Names out of imu, position, pose.
SensorSet WithSensors(SensorSet noise, const std::vector<std::string>& names, const YamlMap& map,
                      const std::string& key);

}  // namespace trueline
