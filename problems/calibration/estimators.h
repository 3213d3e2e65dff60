// All estimators by name, behind one call.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/ekf/ekf_options.h"
#include "problems/kinematic/kinematic_options.h"
#include "problems/result/estimate.h"
#include "problems/smoother/smoother.h"
#include "problems/smoother/whole_flight.h"
#include "problems/vgd/vgd_options.h"
#include "problems/window/flight_data.h"

namespace trueline {

// Options of every estimator; gamma applies to estimators with windows. VGD's options are at the
// top level of the YAML file and also apply to vgd_kinematic and the smoother; `ekf`, `kinematic`,
// `smoother` and `whole_flight` are mappings in it.
struct EstimatorOptions {
  VgdOptions vgd;
  EkfOptions ekf;
  KinematicOptions kinematic;
  SmootherOptions smoother;
  WholeFlightOptions whole_flight;
};

// Names that --estimator takes.
const std::vector<std::string>& KnownEstimators();

// Throws InputError for an unknown name, listing the known ones.
void CheckEstimator(const std::string& name);

// True if results depend on gamma; a filter has no windows.
bool HasWindows(const std::string& name);

// Estimators over one flight with one set of options. Values that depend neither on the estimator
// nor on the window length (the strength of the AHRS drift) are learned once, when first needed.
class Estimators {
 public:
  // Both must outlive this.
  Estimators(const FlightData& flight, const EstimatorOptions& options)
      : flight_(flight), options_(options) {}

  // Runs `name` with windows of `gamma` passes; the result has no windows if the flight has no
  // passes.
  EstimatorRun Run(const std::string& name, int gamma);

  const FlightData& flight() const { return flight_; }
  const EstimatorOptions& options() const { return options_; }
  // By window, as LearnProcess gives them.
  const std::vector<ProcessNoise>& Processes();

 private:
  const FlightData& flight_;
  const EstimatorOptions& options_;
  std::optional<std::vector<ProcessNoise>> processes_;
};

// Reads the keys of `map` over the defaults (see config/calibrate/default.yaml); strict.
EstimatorOptions ReadEstimatorOptions(const YamlMap& map);

// All options with their values, for provenance; ReadEstimatorOptions reads it back.
YAML::Node ToYaml(const EstimatorOptions& options);

}  // namespace trueline
