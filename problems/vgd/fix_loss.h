// The robust losses for fixes and for samples of the accelerometer.
#pragma once

#include "problems/vgd/vgd_options.h"

namespace ceres {
class LossFunction;
}

namespace trueline {

inline constexpr double kForceHuber = 2.5;  // sigmas, on the norm of a sample's x and y

// Each residual block needs its own instance and owns it; null for kNone. `scale` in sigmas.
ceres::LossFunction* MakeLoss(FixLoss loss, double scale);

// The loss's factor on the weight of a fix whose whitened residuals have this norm.
double RobustWeight(FixLoss loss, double scale, double norm);

}  // namespace trueline
