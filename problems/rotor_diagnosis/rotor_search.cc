#include "problems/rotor_diagnosis/rotor_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>
#include <numeric>

#include "problems/rotor_calibration/learn_noise.h"

namespace trueline {
namespace {

constexpr double kCluster = 1.0;   // s, over which residuals may hang together
constexpr double kLocal = 0.1;     // share of a parameter's step, for slopes at a value
constexpr double kLearnOn = 10.0;  // s of flight that noise is learned on
constexpr double kNearStep = 0.4;  // of the logarithm, where noise is learned again
constexpr int kHalvings = 4;
constexpr int kMostSteps = 6;  // of a refit

TestedSystem SystemOf(const RotorNormal& normal) {
  return {normal.M(), normal.b(), [&normal](const Eigen::VectorXd& e, const Eigen::MatrixXd& v) {
            return normal.ClusterProducts(e, v);
          }};
}

// `count` indices from `first`.
std::vector<int> Range(int first, int count) {
  std::vector<int> range(count);
  std::iota(range.begin(), range.end(), first);
  return range;
}

// The last `size` columns of `normal` against all before them.
ScoreTest TestLast(const RotorNormal& normal, const Eigen::VectorXd& ordinary) {
  const int candidate = normal.border() - static_cast<int>(ordinary.size());
  return TestColumns(SystemOf(normal), candidate, candidate, ordinary);
}

Eigen::VectorXd OrdinarySteps(const EffectInfo& info) {
  Eigen::VectorXd ordinary(info.parameters.size());
  for (int i = 0; i < ordinary.size(); ++i) {
    ordinary[i] = info.parameters[i].ordinary / info.parameters[i].step;
    if (EntersSquared(info)) ordinary[i] *= ordinary[i];
  }
  return ordinary;
}

int CountOf(const std::vector<Candidate>& candidates, const std::string& id) {
  return static_cast<int>(std::count_if(candidates.begin(), candidates.end(),
                                        [&](const Candidate& c) { return c.info->id == id; }));
}

void Scale(const Eigen::VectorXd& unit, ScoreTest* test) {
  test->value = test->value.cwiseProduct(unit);
  test->sigma = test->sigma.cwiseProduct(unit);
  test->cov_model = unit.asDiagonal() * test->cov_model * unit.asDiagonal();
  test->cov_cluster = unit.asDiagonal() * test->cov_cluster * unit.asDiagonal();
}

}  // namespace

Eigen::VectorXd SizesFromSteps(const EffectInfo& info, const Eigen::VectorXd& steps) {
  Eigen::VectorXd sizes = steps;
  for (int i = 0; i < sizes.size(); ++i) {
    if (EntersSquared(info)) sizes[i] = std::copysign(std::sqrt(std::abs(sizes[i])), sizes[i]);
    sizes[i] *= info.parameters[i].step;
  }
  return sizes;
}

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
                  ColumnsOf(*world_, std::move(variants), nullptr), kCluster);
}

// True once the step is small against what the flight shows.
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
      // Constants that took the effect's part (inertia, where a moment is missing) make steps long.
      for (int k = 0; k < kHalvings && batch_.cost > cost; ++k) {
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

std::vector<RotorTested> RotorSearch::TestAll(const std::vector<Candidate>& candidates) {
  std::vector<RotorVariant> variants;
  const auto add = [&](const Candidate& candidate, const Eigen::VectorXd& value,
                       const std::vector<Effect>& others) {
    for (RotorVariant& v : VariantsFor(candidate, value, others)) variants.push_back(std::move(v));
  };
  for (std::size_t k = 0; k < found_.size(); ++k) {
    std::vector<Effect> others = effects_;
    others.erase(others.begin() + static_cast<long>(k));
    add(found_[k].candidate, found_[k].value, others);
  }
  const std::vector<int> own = Range(0, static_cast<int>(variants.size()));
  for (const Candidate& candidate : candidates) add(candidate, candidate.Neutral(), effects_);
  const int all = static_cast<int>(variants.size());
  const RotorLibrary library = MakeRotorLibrary(*world_, batch_.mean);
  const RotorNormal normal(world_->model, world_->data, BatchOptions(), batch_,
                           ColumnsOf(*world_, std::move(variants), &library), kCluster);
  const auto test = [&](int first, const Eigen::VectorXd& ordinary) {
    std::vector<int> columns = own;
    for (const int c : Range(first, static_cast<int>(ordinary.size()))) columns.push_back(c);
    return TestLast(normal.Select(columns), ordinary);
  };
  std::vector<RotorTested> tested;
  int first = static_cast<int>(own.size());
  for (const Candidate& candidate : candidates) {
    const Eigen::VectorXd ordinary = OrdinarySteps(*candidate.info);
    const ScoreTest score = test(first, ordinary);
    const double gain = test(first, Eigen::VectorXd::Zero(ordinary.size())).chi2;
    first += static_cast<int>(ordinary.size());
    const double p =
        std::min(1.0, score.p() * std::max(1, CountOf(candidates, candidate.info->id)));
    tested.push_back({candidate, candidate.Neutral() + SizesFromSteps(*candidate.info, score.value),
                      score, gain, p});
  }
  described_.clear();
  for (const RotorTerm& term : library.terms) {
    const ScoreTest score = test(all + term.first, Eigen::VectorXd::Zero(term.count));
    described_.push_back({term.name, score.p(), score.chi2 - 2.0 * term.count});
  }
  return tested;
}

ScoreTest RotorSearch::TestFound(const std::vector<RotorFound>& found, std::size_t which) const {
  std::vector<int> columns, own;
  int at = 0;
  for (std::size_t k = 0; k < found.size(); ++k) {
    for (int i = 0; i < found[k].value.size(); ++i, ++at)
      (k == which ? own : columns).push_back(at);
  }
  columns.insert(columns.end(), own.begin(), own.end());
  const Candidate& candidate = found[which].candidate;
  const Eigen::VectorXd unit = ColumnUnits(*candidate.info);
  const Eigen::VectorXd ordinary = candidate.Ordinary();
  ScoreTest test = TestLast(normal_->Select(columns), ordinary.cwiseQuotient(unit));
  Scale(unit, &test);
  // At the solution the step is zero: what is judged is the value itself.
  test.value = found[which].value - candidate.Neutral();
  test.Judge(test.value, clusters());
  return test;
}

}  // namespace trueline
