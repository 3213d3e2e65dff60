// The task of trueline-design (config/design/*.yaml), by one of two criteria.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "problems/calibration/rotor_calibration.h"
#include "problems/common/strict_yaml.h"
#include "problems/observability/column_scale.h"
#include "problems/observability/design.h"
#include "problems/simulation/simulate_rotor_flight.h"

namespace trueline {

// `criterion: gramian`: sigma_min of the scaled Gramian (Boehm et al. 2020, eq. 5).
struct GramianCriterion {
  RotorDrivenSystem system;
  DesignTarget target;  // scale is filled in by RunDesignTask
  ColumnScale scale = ColumnScale::kBound;
  int scale_flights = 30;  // random flights that give the columns' scale
};

// `criterion: bound`: the Cramer-Rao bound of the batch calibration.
struct BoundCriterion {
  RotorSimulation simulation;
  RotorPrior prior;
  std::vector<ConsideredEffect> considered;
  std::vector<int> show;   // constants
  double ramp = 1.5;       // s, from rest to the figure's full size, and back
  int evaluations = 1800;  // flights tried
};

struct DesignTask {
  std::string source;
  RotorVehicle vehicle;
  std::vector<StateInfo> show;
  DesignOptions
      options;      // by the bound: shape.duration, limits, candidates, seed and threads alone
  int compare = 0;  // random flights, and as many Lissajous figures, to compare with
  std::variant<GramianCriterion, BoundCriterion> criterion;

  bool ByBound() const { return std::holds_alternative<BoundCriterion>(criterion); }
};

// Throws InputError naming file, line and key.
DesignTask ReadDesignTask(const YamlMap& config, std::uint64_t seed, int threads);

}  // namespace trueline
