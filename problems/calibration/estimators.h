// All estimators by name, behind one call.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/ekf/ekf.h"
#include "problems/result/estimate.h"
#include "problems/smoother/smoother.h"
#include "problems/smoother/whole_flight.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd_options.h"

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

class Estimators;

// An estimator that --estimator takes. A new one is a row in estimators.cc, and if it has options a
// member of EstimatorOptions.
struct EstimatorEntry {
  std::string name;
  EstimatorRun (*run)(Estimators* on, int gamma);
  bool windows = true;         // results depend on gamma; a filter has no windows
  bool force_effects = false;  // its model takes aerodynamic effects
  bool whole_flight = false;   // flights of one vehicle are also solved at once (WholeFlight)
  bool carries_past = false;   // an estimate contains all data before it, not its window's alone
};
const std::vector<EstimatorEntry>& AllEstimators();

// Throws InputError for an unknown name, listing the known ones.
const EstimatorEntry& FindEstimator(const std::string& name);

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

// The keys, as config/calibrate/default.yaml states them.
void Serialize(YamlArchive* a, EstimatorOptions* o);

}  // namespace trueline
