// The readers of a configuration's sections, one for each.
#pragma once

#include "problems/common/yaml_options.h"
#include "problems/simulation/config.h"

namespace trueline::simulation {

// Each keeps the value that is there where a key is left out, and throws InputError with file, line
// and key.
CourseConfig ReadCourse(const YamlMap& map);
VehicleConfig ReadVehicle(const YamlMap& map, double gravity);
AutopilotConfig ReadAutopilot(const YamlMap& map);
TurbulenceConfig ReadTurbulence(const YamlMap& map);
ImuConfig ReadImu(const YamlMap& map);
AhrsConfig ReadAhrs(const YamlMap& map);
DetectorConfig ReadDetector(const YamlMap& map);

}  // namespace trueline::simulation
