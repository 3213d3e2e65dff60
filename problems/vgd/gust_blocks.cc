#include "problems/vgd/gust_blocks.h"

#include <ceres/normal_prior.h>

#include <cmath>
#include <memory>

#include "cost_functions/gust_residual.h"
#include "cost_functions/gust_step_residual.h"

namespace trueline {

GustBlocks::GustBlocks(const ProcessNoise& noise, std::vector<bool> linked,
                       std::vector<Eigen::Vector2d>* values, ceres::Problem* problem)
    : noise_(noise), linked_(std::move(linked)), values_(values) {
  for (Eigen::Vector2d& value : *values_) problem->AddParameterBlock(value.data(), kGustSize);
}

ceres::ResidualBlockId GustBlocks::Add(ceres::Problem* problem, ceres::CostFunction* cost,
                                       ceres::LossFunction* loss, std::vector<double*> blocks,
                                       std::size_t s, const Eigen::MatrixXd& d_gusts) const {
  if (!Any()) return problem->AddResidualBlock(cost, loss, blocks);
  blocks.push_back(block(s));
  if (!held(s)) blocks.push_back(block(s + 1));
  std::unique_ptr<ceres::CostFunction> inner(cost);
  return problem->AddResidualBlock(new GustResidual(std::move(inner), d_gusts, held(s)), loss,
                                   blocks);
}

ceres::ResidualBlockId GustBlocks::AddPrior(ceres::Problem* problem, std::size_t s,
                                            double* log_weights) const {
  *log_weights -= kGustSize * std::log(noise_.gust);
  const Eigen::Matrix2d weight = Eigen::Matrix2d::Identity() / noise_.gust;
  return problem->AddResidualBlock(new ceres::NormalPrior(weight, Eigen::VectorXd::Zero(kGustSize)),
                                   nullptr, block(s));
}

ceres::ResidualBlockId GustBlocks::AddStep(ceres::Problem* problem, std::size_t s, double seconds,
                                           double* log_weights) const {
  const double sigma = noise_.GustStepSigma(seconds);
  *log_weights -= kGustSize * std::log(sigma);
  return problem->AddResidualBlock(new GustStepResidual(noise_.GustDecay(seconds), 1.0 / sigma),
                                   nullptr, block(s), block(s + 1));
}

GustPair GustBlocks::At(std::size_t s) const {
  GustPair gusts;
  gusts << (*values_)[s], (*values_)[held(s) ? s : s + 1];
  return gusts;
}

}  // namespace trueline
