// Whether a flight contradicts the prior that a model of other flights gives it, or another flight
// of what is said to be the same vehicle.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "problems/result/estimate.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

// Two independent statements about a parameter whose difference is larger than 4 of its standard
// deviations.
struct Conflict {
  std::string name, unit;
  double one, one_sigma;      // of the prior, or of the first flight
  double other, other_sigma;  // what the flight alone shows
};

// Vehicle parameters of which the flight alone, by windows that share no data, says something else
// than the prior (Evans and Moshonov 2006, check of a prior by its predictive distribution).
std::vector<Conflict> ConflictsWithPrior(const std::array<ParameterPrior, kMotionSize>& priors,
                                         const EstimatorRun& run);

// Parameters of the airframe of which two flights, each alone, say different things. Both were
// estimated with `priors`, which take no part.
std::vector<Conflict> ConflictsBetween(const std::array<ParameterPrior, kMotionSize>& priors,
                                       const std::vector<ParameterEstimate>& one,
                                       const std::vector<ParameterEstimate>& other);

}  // namespace trueline
