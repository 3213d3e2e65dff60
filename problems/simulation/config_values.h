// The sections of a configuration, each described once.
#pragma once

#include "problems/common/yaml_archive.h"
#include "problems/simulation/config.h"
#include "problems/simulation/motor_drive.h"

namespace trueline::simulation {

CourseConfig ReadCourse(const YamlMap& map);
VehicleConfig ReadVehicle(const YamlMap& map, double gravity);
void Serialize(YamlArchive* a, MotorDriveConfig* drive);
void Serialize(YamlArchive* a, BladeConfig* blades);
void Serialize(YamlArchive* a, AutopilotConfig* autopilot);
void Serialize(YamlArchive* a, TurbulenceConfig* turbulence);
void Serialize(YamlArchive* a, ImuConfig* imu);
void Serialize(YamlArchive* a, AhrsConfig* ahrs);
void Serialize(YamlArchive* a, DetectorConfig* detector);
void Serialize(YamlArchive* a, GnssConfig* gnss);
// Each sensor has a section of its own; all numbers are zero or above.
void Serialize(YamlArchive* a, SensorSettings* sensors);

}  // namespace trueline::simulation
