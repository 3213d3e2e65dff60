// Values of a configuration, checked as they are read: a key that is left out keeps the value that
// is there. Shared by the readers of this folder.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "problems/simulation/config.h"

namespace trueline::simulation {

inline void Read(const YamlMap& map, const std::string& key, Vector3d* value) {
  *value = map.GetVector3(key, *value);
  if (!value->allFinite()) map.Fail(key, "must be finite numbers");
}

inline void Read(const YamlMap& map, const std::string& key, double* value) {
  *value = map.Get<double>(key, *value);
  if (!std::isfinite(*value)) map.Fail(key, "must be a finite number");
}

inline void ReadPositive(const YamlMap& map, const std::string& key, double* value) {
  Read(map, key, value);
  if (*value <= 0.0) map.Fail(key, fmt::format("must be above 0, found {}", *value));
}

inline void ReadNotNegative(const YamlMap& map, const std::string& key, double* value) {
  Read(map, key, value);
  if (*value < 0.0) map.Fail(key, fmt::format("must be 0 or more, found {}", *value));
}

inline void ReadNotNegative(const YamlMap& map, const std::string& key, Vector3d* value) {
  Read(map, key, value);
  if (value->minCoeff() < 0.0) map.Fail(key, "must be 0 or more on each axis");
}

// The readers of the sections. Each throws InputError with file, line and key.
CourseConfig ReadCourse(const YamlMap& map);
VehicleConfig ReadVehicle(const YamlMap& map, double gravity);
AutopilotConfig ReadAutopilot(const YamlMap& map);
TurbulenceConfig ReadTurbulence(const YamlMap& map);
ImuConfig ReadImu(const YamlMap& map);
AhrsConfig ReadAhrs(const YamlMap& map);
DetectorConfig ReadDetector(const YamlMap& map);
void ReadStreams(const YamlMap& map, SimulationConfig* config);

}  // namespace trueline::simulation
