// How flags and YAML files become the options of a calibration.
#pragma once

#include <string>

#include "problems/calibration/calibration.h"

namespace trueline {

// Flags as typed; empty (or 0) where the configuration decides.
struct CalibrationFlags {
  std::string config;       // YAML file with the keys of ReadEstimatorOptions
  std::string model;        // model.yaml of an earlier calibration
  std::string estimators;   // "vgd,ekf"
  std::string gamma_sweep;  // "1,2,3"
  std::string thrust;       // accelerometer | level_flight
  int gamma = 0;
};

// Throws InputError for what is unknown or out of range.
CalibrationOptions ResolveCalibrationOptions(const CalibrationFlags& flags);

// Throws InputError where further logs are given that no estimator would look at.
void CheckOtherLogs(const std::vector<FlightLog>& others, const CalibrationOptions& options);

// Makes the vehicle's constants (drag, misalignment, biases: not the AHRS error, which is the
// flight's own) of an earlier calibration the prior of this one. Returns the model's effects; those
// that are forces are set in the options.
std::vector<Effect> ApplyModel(const std::string& model_file, VgdOptions* options);

// The resolved options, for provenance.
YAML::Node ToYaml(const CalibrationOptions& options);

}  // namespace trueline
