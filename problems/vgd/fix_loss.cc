#include "problems/vgd/fix_loss.h"

#include <ceres/loss_function.h>

#include <memory>

#include "cost_functions/huber.h"

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
  const std::unique_ptr<const ceres::LossFunction> function(MakeLoss(loss, scale));
  if (!function) return 1.0;
  double rho[3];
  function->Evaluate(norm * norm, rho);
  return rho[1];
}

}  // namespace trueline
