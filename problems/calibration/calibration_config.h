// How flags and YAML files become the options of a calibration.
#pragma once

#include <string>

#include "problems/calibration/calibration.h"

namespace trueline {

// Flags as typed; an empty one (or 0) leaves the value to the configuration.
struct CalibrationFlags {
  std::string config;       // YAML file with the keys of EstimatorOptions
  std::string model;        // model.yaml of an earlier calibration
  std::string estimators;   // "vgd,ekf"
  std::string gamma_sweep;  // "1,2,3"
  std::string thrust;       // accelerometer | level_flight | as_published
  int gamma = 0;
};

// Throws InputError for what is unknown or out of range.
CalibrationOptions ResolveCalibrationOptions(const CalibrationFlags& flags);

// Throws InputError for further logs that no chosen estimator uses.
void CheckOtherLogs(const std::vector<FlightLog>& others, const CalibrationOptions& options);

// Makes the vehicle's constants of an earlier calibration (drag, misalignment, biases) the prior of
// this one; the AHRS error belongs to a flight and is not taken over. Returns the model's effects;
// force effects are set in the options.
std::vector<Effect> ApplyModel(const std::string& model_file, VgdOptions* options);

// Leaves in the options what of the model holds for these flights, and warns of the rest (see
// own_model.h). Throws InputError for effects that are left and that an estimator does not take.
void LimitModelTo(const std::vector<FlightLog>& logs, const std::string& model_file,
                  CalibrationOptions* options);

// The resolved options, for provenance.
YAML::Node ToYaml(const CalibrationOptions& options);

}  // namespace trueline
