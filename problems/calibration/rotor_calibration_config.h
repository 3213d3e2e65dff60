// Options of trueline-calibrate --drive=rotors, from YAML (config/calibrate/rotors.yaml).
#pragma once

#include <span>
#include <string>

#include "problems/calibration/rotor_calibration.h"
#include "problems/common/yaml_archive.h"

namespace trueline {

// `config`: a YAML file, or empty for the vehicle stated in the first of `logs`. `model`:
// model.yaml of an earlier calibration of this vehicle, or empty; its constants other than biases
// become the prior, unless it was fitted to one of `logs`; the prior without them is kept beside
// it. Throws InputError naming file, line and key.
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
