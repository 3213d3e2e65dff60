// Model error as an uncertainty of the constants: effects of the catalogue that are not estimated,
// each with its usual size on such vehicles. Estimates do not change; intervals are widened by the
// bias that the effects would cause.
#pragma once

#include <string>
#include <vector>

#include "problems/calibration/rotor_calibration.h"
#include "problems/rotor/rotor_normal.h"

namespace trueline {

// `map`: {id: {parameter: sigma, mean zero}}, such as {rotor_loss: {factor: 0.01}} for rotors that
// differ by 1 %. Throws InputError for unknown effects or parameters and lists the known ones.
std::vector<ConsideredEffect> ReadConsidered(const YamlMap& map);
YAML::Node ToYaml(const std::vector<ConsideredEffect>& considered);
// All parameters of an effect that can be considered.
const std::vector<std::string>& ConsiderableParameters(const std::string& id);

// Variants with each effect at one sigma; rotor_loss gives one for each rotor. Effects that the
// model already has, or estimates as a constant, are left out.
std::vector<RotorVariant> ConsideredVariants(const FlightLog& log,
                                             const RotorCalibrationOptions& options,
                                             const RotorDataOptions& streams);

}  // namespace trueline
