// Whether a flight by rotor speeds contradicts the prior that a model of other flights gives it.
#pragma once

#include <vector>

#include "problems/calibration/conflict.h"
#include "problems/rotor/rotor_batch.h"
#include "problems/rotor/rotor_prior.h"

namespace trueline {

// What the model says of the constants whose prior it changes, and what the flight alone says of
// them: its fit `flight` with the prior `fitted_with`, which takes no part. Constants that the
// flight does not show are left out.
std::vector<Statements> CompareWithModel(const RotorPrior& model, const RotorPrior& fitted_with,
                                         const RotorBatchResult& flight);

// True if the flight contradicts the model's constants, each by itself or all together. The model
// states no correlations: its prior is that of independent constants, also in a fit.
bool Contradicts(const RotorPrior& model, const RotorPrior& fitted_with,
                 const RotorBatchResult& flight);

// The configuration's prior without the model, for a flight that the model's prior was meant for.
// Constants that the configuration lacks (known to be zero) and the model has, such as drag, are
// forces of the vehicle as effects are. Without them the other constants would come out wrong, so
// they stay: those that the model estimated with a prior as wide as its value is large.
RotorPrior WithoutModel(RotorPrior configured, const RotorPrior& with_model);

}  // namespace trueline
