// Options of trueline-calibrate --drive=rotors, from YAML (config/calibrate/rotors.yaml).
#pragma once

#include <string>

#include "problems/calibration/rotor_calibration.h"

namespace trueline {

// `config`: a YAML file, or empty for the vehicle stated in the log. `model`: model.yaml of an
// earlier calibration of this vehicle, or empty; its constants other than biases become the prior.
// Throws InputError naming file, line and key.
RotorCalibrationOptions ResolveRotorOptions(const std::string& config, const std::string& model,
                                            const FlightLog& log);

// Keys fit_to, attitude, pose_rate, start, end, hold_out, learn_noise, rotor_delay,
// learn_rotor_delay, robust_pose, widen, wander, noise and prior replace the values in `options`.
// The caller reads `vehicle` and `motors`.
void ReadRotorOptions(const YamlMap& map, RotorCalibrationOptions* options);

// The resolved options, for provenance.
YAML::Node ToYaml(const RotorCalibrationOptions& options);

}  // namespace trueline
