// What noise on measured rotor speeds does to a batch's constants, and its removal.
#pragma once

#include "problems/rotor/rotor_batch.h"

namespace trueline {

// Fits the batch to less smoothed speeds, and subtracts the bias that their noise causes. The bias
// is measured: speeds with noise of the same size, added and subtracted, move the constants by
// it on average (simulation extrapolation, Cook and Stefanski 1994, with antithetic pairs, which
// cancel what is linear in the noise). `batch` is the solution for `data`, which is returned where
// the speeds are exact or where a model without its bias would be no body. `bias`, if not null,
// becomes what was subtracted.
RotorBatchResult WithoutSpeedNoiseBias(const RotorAeroModel& model, const RotorData& data,
                                       const RotorBatchOptions& options,
                                       const RotorBatchResult& batch,
                                       RotorConstants* bias = nullptr);

}  // namespace trueline
