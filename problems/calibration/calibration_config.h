// How flags and YAML files become the options of a calibration.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "problems/calibration/calibration.h"
#include "problems/calibration/rotor_calibration.h"
#include "problems/common/yaml_archive.h"
#include "problems/effects/effect.h"
#include "problems/log/flight_log.h"

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

// Leaves in the options what of the model holds for these flights, and warns of the rest: constants
// fitted to one of them, and effects of another flight. Throws InputError for effects that are left
// and that an estimator does not take.
void LimitModelTo(const std::vector<FlightLog>& logs, const std::string& model_file,
                  CalibrationOptions* options);

// The resolved options, for provenance.
YAML::Node ToYaml(const CalibrationOptions& options);

// Options of trueline-calibrate --drive=rotors, from YAML (config/calibrate/rotors.yaml).
// `config`: a file, or empty for the vehicle stated in the first of `logs`. `model`: model.yaml of
// an earlier calibration of this vehicle, or empty; its constants other than biases become the
// prior, unless it was fitted to one of `logs`; the prior without them is kept beside it. Throws
// InputError naming file, line and key.
RotorCalibrationOptions ResolveRotorOptions(const std::string& config, const std::string& model,
                                            std::span<const FlightLog> logs);
inline RotorCalibrationOptions ResolveRotorOptions(const std::string& config,
                                                   const std::string& model, const FlightLog& log) {
  return ResolveRotorOptions(config, model, std::span(&log, 1));
}

// All keys but `vehicle` and `motors`, which the caller reads.
void Serialize(YamlArchive* a, RotorCalibrationOptions* o);
void ReadRotorOptions(const YamlMap& map, RotorCalibrationOptions* options);

// The resolved options, for provenance.
YAML::Node ToYaml(const RotorCalibrationOptions& options);

}  // namespace trueline
