#include <algorithm>
#include <cmath>
#include <numeric>

#include "problems/rotor_diagnosis/rotor_search.h"

namespace trueline {
namespace {

constexpr double kReadOff = 0.01;  // chance, over all terms, of taking good readings for bad ones

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

std::vector<RotorTested> RotorSearch::TestAll(const std::vector<Candidate>& candidates) {
  const RotorLibrary library = MakeRotorLibrary(*world_, batch_.mean);
  return TestWith(&library, candidates);
}

std::vector<RotorTested> RotorSearch::TestWith(const RotorLibrary* library,
                                               const std::vector<Candidate>& candidates) {
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
  const RotorNormal normal(world_->model, world_->data, BatchOptions(), batch_,
                           ColumnsOf(*world_, std::move(variants), library), kRotorCluster);
  std::vector<int> beside = own, read;  // columns that are no candidate's
  const auto test = [&](int first, const Eigen::VectorXd& ordinary) {
    std::vector<int> columns = beside;
    for (const int c : Range(first, static_cast<int>(ordinary.size()))) columns.push_back(c);
    return TestLast(normal.Select(columns), ordinary);
  };
  const auto test_each = [&] {
    std::vector<RotorTested> tested;
    int first = static_cast<int>(own.size());
    for (const Candidate& c : candidates) {
      const Eigen::VectorXd ordinary = OrdinarySteps(*c.info);
      const ScoreTest score = test(first, ordinary);
      const double gain = test(first, Eigen::VectorXd::Zero(ordinary.size())).chi2;
      first += static_cast<int>(ordinary.size());
      const double p = std::min(1.0, score.p() * std::max(1, CountOf(candidates, c.info->id)));
      tested.push_back({c, c.Neutral() + SizesFromSteps(*c.info, score.value), score, gain, p});
    }
    return tested;
  };
  std::vector<RotorTested> tested = test_each();
  if (library == nullptr) return tested;
  double merit = 0.0;
  for (const RotorTested& t : tested) merit = std::max(merit, t.Merit());
  const auto describe = [&](bool of_sensor) {
    for (const RotorTerm& term : library->terms) {
      if (term.of_sensor != of_sensor) continue;
      const ScoreTest score = test(all + term.first, Eigen::VectorXd::Zero(term.count));
      described_.push_back({term.name, score.p() * static_cast<double>(library->terms.size()),
                            score.chi2 - 2.0 * term.count, of_sensor});
      if (!of_sensor || !described_.back().Stands(kReadOff, merit)) continue;
      for (const int c : Range(all + term.first, term.count)) read.push_back(c);
    }
  };
  described_.clear();
  describe(true);
  beside.insert(beside.end(), read.begin(), read.end());
  describe(false);
  return read.empty() ? tested : test_each();
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
