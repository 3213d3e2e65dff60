// All estimators by name, behind one call.
#pragma once

#include <string>
#include <vector>

#include "problems/result/estimate.h"
#include "problems/vgd/vgd_options.h"
#include "problems/window/flight_data.h"

namespace trueline {

// Options of every estimator; gamma counts where an estimator has windows.
struct EstimatorOptions {
  VgdOptions vgd;
};

// Names that --estimator takes.
const std::vector<std::string>& KnownEstimators();

// Throws InputError for an unknown name, listing the known ones.
void CheckEstimator(const std::string& name);

// Runs `name` over the flight with windows of `gamma` passes.
EstimatorRun RunEstimator(const std::string& name, const FlightData& flight,
                          const EstimatorOptions& options, int gamma);

// Reads the keys of `map` over the defaults (see config/calibrate/default.yaml); strict.
EstimatorOptions ReadEstimatorOptions(const YamlMap& map);

// All options with their values, for provenance; ReadEstimatorOptions reads it back.
YAML::Node ToYaml(const EstimatorOptions& options);

}  // namespace trueline
