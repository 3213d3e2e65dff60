// Whether a flight contradicts the prior that a model of other flights gives it.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "problems/result/estimate.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

struct PriorConflict {
  std::string name, unit;
  double prior, prior_sigma;
  double flight, flight_sigma;  // what the flight alone shows
};

// Vehicle parameters of which the flight alone, by windows that share no pass, says something else
// than the prior: the difference is larger than 4 of its standard deviations (Evans and Moshonov
// 2006, check of a prior by its predictive distribution).
std::vector<PriorConflict> ConflictsOf(const std::array<ParameterPrior, kMotionSize>& priors,
                                       const EstimatorRun& run);

}  // namespace trueline
