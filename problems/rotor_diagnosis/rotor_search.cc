#include "problems/rotor_diagnosis/rotor_search.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "problems/calibration/learn_rotor_noise.h"

namespace trueline {
namespace {

constexpr double kLocal = 0.1;     // share of a parameter's step, for slopes at a value
constexpr double kLearnOn = 10.0;  // s of flight that noise is learned on
constexpr double kNearStep = 0.4;  // of the logarithm, where noise is learned again
constexpr int kHalvings = 4;
constexpr int kMostSteps = 6;          // of a refit
constexpr double kCostIncrease = 0.5;  // of cost; a smaller rise comes from re-evaluated weights

}  // namespace

Eigen::VectorXd ColumnUnits(const EffectInfo& info) {
  Eigen::VectorXd units(info.parameters.size());
  for (int i = 0; i < units.size(); ++i) units[i] = kLocal * info.parameters[i].step;
  return units;
}

RotorSearch::RotorSearch(const FlightLog& log, const RotorCalibrationOptions& options)
    : log_(log), options_(options), stated_(options.noise) {
  RotorEkfOptions filter{options.noise, options.prior, options.wander};
  LearnFromFlight(ModelFor(options, log.gravity), log,
                  {options.learn_noise, options.learn_rotor_delay, kLearnOn, stated_},
                  &options_.data, &filter);
  options_.noise = filter.noise;
}

RotorBatchOptions RotorSearch::BatchOptions() const {
  return {options_.noise, world_->prior, options_.robust_pose};
}

std::vector<RotorVariant> RotorSearch::VariantsFor(const Candidate& candidate,
                                                   const Eigen::VectorXd& value,
                                                   const std::vector<Effect>& others) const {
  std::vector<RotorVariant> variants;
  const bool at_neutral = value == candidate.Neutral();
  for (int i = 0; i < value.size(); ++i) {
    const double move = candidate.info->parameters[i].step * (at_neutral ? 1.0 : kLocal);
    variants.push_back(VariantOf(log_, options_, *world_, others, candidate, value, i, move));
  }
  return variants;
}

void RotorSearch::Refit(const std::vector<RotorFound>& found) {
  found_ = found;
  effects_.clear();
  for (const RotorFound& f : found) effects_.push_back(f.candidate.At(f.value));
  world_ = std::make_unique<RotorWorld>(MakeRotorWorld(log_, options_, effects_));
  const RotorBatchResult before = batch_;
  batch_ = RunRotorBatch(world_->model, world_->data, BatchOptions(), started_ ? &before : nullptr);
  started_ = true;
  std::vector<RotorVariant> variants;
  for (std::size_t k = 0; k < found.size(); ++k) {
    std::vector<Effect> others = effects_;
    others.erase(others.begin() + static_cast<long>(k));
    for (RotorVariant& v : VariantsFor(found[k].candidate, found[k].value, others)) {
      variants.push_back(std::move(v));
    }
  }
  normal_.emplace(world_->model, world_->data, BatchOptions(), batch_,
                  ColumnsOf(*world_, std::move(variants), nullptr), kRotorCluster);
}

// One Gauss-Newton step of the causes. True if it is small in sigmas.
bool RotorSearch::Step(std::vector<RotorFound>* found) const {
  constexpr double kSmall = 0.1;  // sigmas
  const Eigen::LLT<Eigen::MatrixXd> llt(normal_->M());
  const Eigen::VectorXd z = llt.solve(-normal_->b());
  const Eigen::MatrixXd cov = llt.solve(Eigen::MatrixXd::Identity(z.size(), z.size()));
  bool settled = true;
  int at = normal_->constants();
  for (RotorFound& f : *found) {
    for (int i = 0; i < f.value.size(); ++i, ++at) {
      const EffectParameterInfo& info = f.candidate.info->parameters[i];
      f.value[i] += z[at] * kLocal * info.step;
      if (!info.either_sign) f.value[i] = std::max(f.value[i], 1e-3 * info.step);
      settled = settled && std::abs(z[at]) < kSmall * std::sqrt(cov(at, at));
    }
  }
  return settled;
}

void RotorSearch::Fit(std::vector<RotorFound>* found) {
  for (int round = 0; round < 2; ++round) {
    Refit(*found);
    if (found->empty()) return;
    for (int i = 0; i < kMostSteps; ++i) {
      const std::vector<RotorFound> before = *found;
      const double cost = batch_.cost;
      const bool settled = Step(found);
      Refit(*found);
      if (settled) break;
      // Constants that absorbed part of the effect (inertia for a missing moment) make steps too
      // long.
      for (int k = 0; k < kHalvings && batch_.cost > cost + kCostIncrease; ++k) {
        for (std::size_t f = 0; f < before.size(); ++f) {
          (*found)[f].value = 0.5 * ((*found)[f].value + before[f].value);
        }
        Refit(*found);
      }
    }
    if (round == 1 || !options_.learn_noise) return;
    RotorEkfOptions filter{options_.noise, world_->prior, options_.wander};
    RotorDataOptions streams = options_.data;
    streams.motor_lag += RotorExtensionOf(effects_).motor_lag;
    LearnFromFlight(world_->model, log_, {true, false, kLearnOn, stated_, kNearStep}, &streams,
                    &filter);
    options_.noise = filter.noise;
  }
}

}  // namespace trueline
