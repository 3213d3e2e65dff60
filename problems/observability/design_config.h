// The task of trueline-design (config/design/*.yaml), by one of two criteria.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "problems/common/strict_yaml.h"
#include "problems/observability/bound_design.h"
#include "problems/observability/column_scale.h"
#include "problems/observability/design.h"

namespace trueline {

// `criterion: gramian`: sigma_min of the scaled Gramian (Boehm et al. 2020, eq. 5).
struct GramianCriterion {
  RotorDrivenSystem system;
  DesignTarget target;            // scale is filled in by RunDesignTask
  ColumnScaleOptions scale = {};  // kind and number of flights alone
};

struct DesignTask {
  std::string source;
  RotorVehicle vehicle;
  std::vector<StateInfo> show;
  DesignOptions options;  // by the bound: shape, limits, seed and threads alone
  int compare = 0;        // random flights, and as many Lissajous figures, to compare with
  std::variant<GramianCriterion, BoundDesign> criterion;  // by the Gramian, or `bound`

  bool ByBound() const { return std::holds_alternative<BoundDesign>(criterion); }
};

// Throws InputError naming file, line and key.
DesignTask ReadDesignTask(const YamlMap& config, std::uint64_t seed, int threads);

}  // namespace trueline
