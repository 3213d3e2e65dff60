// The robust losses for fixes.
#pragma once

#include "problems/vgd/vgd_options.h"

namespace ceres {
class LossFunction;
}

namespace trueline {

// Each residual block needs its own instance and owns it; null for kNone. `scale` in sigmas.
ceres::LossFunction* MakeLoss(FixLoss loss, double scale);

// The loss's factor on the weight of a fix whose whitened residuals have this norm.
double RobustWeight(FixLoss loss, double scale, double norm);

}  // namespace trueline
