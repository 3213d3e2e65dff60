// The robust losses that a fit may judge its fixes by.
#pragma once

#include "problems/vgd/vgd_options.h"

namespace ceres {
class LossFunction;
}

namespace trueline {

// One instance serves one residual block, which owns it; null for kNone. `scale` in sigmas.
ceres::LossFunction* MakeLoss(FixLoss loss, double scale);

// What is left of a fix's weight whose whitened residuals have this norm.
double RobustWeight(FixLoss loss, double scale, double norm);

}  // namespace trueline
