// How a chain of segments is minimised: by its own normal equations, or by Ceres.
#include <algorithm>
#include <chrono>
#include <cmath>

#include "problems/common/units.h"
#include "problems/vgd/segment_chain.h"
#include "problems/vgd/solver_options.h"

namespace trueline {

// A chain as a problem for MinimiseInTrustRegion.
class SegmentChain::Minimiser {
 public:
  explicit Minimiser(SegmentChain* chain) : chain_(*chain) { chain_.normal().ForgetUnits(); }

  double Linearise(double radius, double* cost) {
    start_ = chain_.x_;
    *cost = chain_.Linearise(radius);
    return chain_.normal_->Solve();
  }

  double Try() {
    Unknowns& x = chain_.x_;
    step_ = norm_ = 0.0;
    const auto move = [&](int block, int at, int size, double* to) {
      const double* step = chain_.normal_->step(block) + at;
      for (int i = 0; i < size; ++i) {
        norm_ += to[i] * to[i];
        step_ += step[i] * step[i];
        to[i] += step[i];
      }
    };
    for (std::size_t s = 0; s < chain_.size(); ++s) {
      move(chain_.BlockOf(s), 0, kNodeSize, x.nodes[s].data());
    }
    for (std::size_t k = 0; k < x.theta.size(); ++k) {
      move(chain_.BlockOfSection(k), 0, kThetaSize, x.theta[k].data());
      if (chain_.bounded_) ClampToBounds(&x.theta[k]);
    }
    for (const Border& border : chain_.border_) {
      const auto& [data, size, column] = border.block;
      const std::size_t section = border.local ? border.section : x.theta.size() - 1;
      move(chain_.BlockOfSection(section), column - Normal::kSharedAt, size, data);
    }
    chain_.Refresh(false);
    return chain_.Cost();
  }

  bool IsSmall(double tolerance) const {
    return std::sqrt(step_) <= tolerance * (std::sqrt(norm_) + tolerance);
  }
  void Return() { chain_.x_ = start_; }
  void Keep() { best_ = chain_.x_; }
  void Restore() { chain_.x_ = best_; }

 private:
  void ClampToBounds(ThetaVector* theta) const {
    for (int i = 0; i < kMotionSize; ++i) {
      const auto [lower, upper] = chain_.ScaledBounds(i);
      (*theta)[i] = std::clamp((*theta)[i], lower, upper);
    }
  }

  SegmentChain& chain_;
  Unknowns start_, best_;
  double step_ = 0.0, norm_ = 0.0;  // squared, before the bounds
};

ceres::Solver::Summary SegmentChain::Solve(const TrustRegionOptions& options) {
  const auto began = std::chrono::steady_clock::now();
  Minimiser minimiser(this);
  const TrustRegionResult result = MinimiseInTrustRegion(&minimiser, options);
  Refresh(false);
  ceres::Solver::Summary summary;
  summary.iterations.resize(result.iterations + 1);
  summary.termination_type = result.converged ? ceres::CONVERGENCE : ceres::NO_CONVERGENCE;
  summary.final_cost = result.cost;
  summary.total_time_in_seconds = SecondsSince(began);
  return summary;
}

ceres::Solver::Summary SegmentChain::Solve(const ceres::Solver::Options& options) {
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem(), &summary);
  Refresh(true);
  return summary;
}

ceres::Problem& SegmentChain::problem() {
  if (problem_) return *problem_;
  ceres::Problem::Options options = ProblemOptions(this);
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_ = std::make_unique<ceres::Problem>(options);
  const auto add = [&](const Term& term) {
    std::vector<double*> blocks;
    for (int b = 0; b < term.count; ++b) blocks.push_back(term.blocks[b].data);
    problem_->AddResidualBlock(term.cost.get(), term.loss.get(), blocks);
  };
  for (const std::vector<Term>& terms : terms_) std::for_each(terms.begin(), terms.end(), add);
  std::for_each(theta_steps_.begin(), theta_steps_.end(), add);
  for (ThetaVector& theta : x_.theta) {
    if (theta_held_) problem_->SetParameterBlockConstant(theta.data());
    for (int i = 0; bounded_ && i < kMotionSize; ++i) {
      const auto [lower, upper] = ScaledBounds(i);
      problem_->SetParameterLowerBound(theta.data(), i, lower);
      problem_->SetParameterUpperBound(theta.data(), i, upper);
    }
  }
  if (drift_held_) {
    problem_->SetManifold(x_.nodes[0].data(), new ceres::SubsetManifold(kGustAt, {0, 1, 2}));
  }
  return *problem_;
}

}  // namespace trueline
