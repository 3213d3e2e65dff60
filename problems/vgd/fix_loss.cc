#include "problems/vgd/fix_loss.h"

#include <ceres/loss_function.h>

#include <algorithm>

#include "cost_functions/norm_loss.h"

namespace trueline {

ceres::LossFunction* MakeLoss(FixLoss loss, double scale) {
  switch (loss) {
    case FixLoss::kHuber:
      return new ceres::HuberLoss(scale);
    case FixLoss::kCauchy:
      return new ceres::CauchyLoss(scale);
    case FixLoss::kNorm:
      return new NormLoss();
    case FixLoss::kNone:
      break;
  }
  return nullptr;
}

double RobustWeight(FixLoss loss, double scale, double norm) {
  switch (loss) {
    case FixLoss::kHuber:
      return norm > scale ? scale / norm : 1.0;
    case FixLoss::kCauchy:
      return 1.0 / (1.0 + norm * norm / (scale * scale));
    case FixLoss::kNorm:
      return 1.0 / std::max(norm, 1e-3);
    case FixLoss::kNone:
      break;
  }
  return 1.0;
}

}  // namespace trueline
