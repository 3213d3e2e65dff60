// What a model lacks, as an uncertainty of its constants: effects of the catalogue that are not
// estimated, with the size that such vehicles usually have. Values do not change; intervals take in
// what the effects would move them by.
#pragma once

#include <string>
#include <vector>

#include "problems/rotor_batch/rotor_variant.h"
#include "problems/rotor_calibration/rotor_calibration.h"

namespace trueline {

// `map`: {id: {parameter: sigma about none}}, such as {rotor_loss: {factor: 0.01}} for rotors that
// differ by 1 %. Throws InputError for what is no such effect or parameter, naming those there are.
std::vector<ConsideredEffect> ReadConsidered(const YamlMap& map);
YAML::Node ToYaml(const std::vector<ConsideredEffect>& considered);
// All parameters of an effect that can be considered.
const std::vector<std::string>& ConsiderableParameters(const std::string& id);

// Each effect at one sigma, beside those that the model has; a loss for each rotor by itself. What
// the model has, or estimates as a constant, is left out.
std::vector<RotorVariant> ConsideredVariants(const FlightLog& log,
                                             const RotorCalibrationOptions& options,
                                             const RotorDataOptions& streams);

}  // namespace trueline
