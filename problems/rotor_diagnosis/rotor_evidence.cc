#include "problems/rotor_diagnosis/rotor_evidence.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "problems/diagnosis/choose.h"

namespace trueline {
namespace {

constexpr double kReadOff = 0.01;  // chance, over all terms, of naming a reading that is good

// `count` indices from `first`.
std::vector<int> Range(int first, int count) {
  std::vector<int> range(count);
  std::iota(range.begin(), range.end(), first);
  return range;
}

std::vector<int> Concatenated(std::vector<int> columns, const std::vector<int>& more) {
  columns.insert(columns.end(), more.begin(), more.end());
  return columns;
}

int SizeOf(const Candidate& candidate) {
  return static_cast<int>(candidate.info->parameters.size());
}

Eigen::VectorXd OrdinarySteps(const EffectInfo& info) {
  Eigen::VectorXd ordinary(info.parameters.size());
  for (int i = 0; i < ordinary.size(); ++i) {
    ordinary[i] = info.parameters[i].ordinary / info.parameters[i].step;
    if (info.enters_squared) ordinary[i] *= ordinary[i];
  }
  return ordinary;
}

// Number of candidates with the same id, including the finer times that refine a step.
int TriedLike(const Candidate& candidate, const std::vector<Candidate>& candidates) {
  const auto count = std::count_if(candidates.begin(), candidates.end(), [&](const Candidate& c) {
    return c.info->id == candidate.info->id;
  });
  return static_cast<int>(count) * (IsStep(candidate) ? kFinerSteps : 1);
}

}  // namespace

ScoreTest TestLast(const RotorNormal& normal, const Eigen::VectorXd& ordinary) {
  const int candidate = normal.border() - static_cast<int>(ordinary.size());
  return TestColumns(normal, candidate, candidate, ordinary);
}

Eigen::VectorXd SizesFromSteps(const EffectInfo& info, const Eigen::VectorXd& steps) {
  Eigen::VectorXd sizes = steps;
  for (int i = 0; i < sizes.size(); ++i) {
    if (info.enters_squared) sizes[i] = std::copysign(std::sqrt(std::abs(sizes[i])), sizes[i]);
    sizes[i] *= info.parameters[i].step;
  }
  return sizes;
}

std::vector<std::size_t> BestOfEach(const std::vector<RotorTested>& tested) {
  std::map<std::pair<std::string, double>, std::size_t> best;
  for (std::size_t i = 0; i < tested.size(); ++i) {
    const std::map<std::string, double>& fixed = tested[i].candidate.fixed;
    const double rotor = fixed.count("rotor") > 0 ? fixed.at("rotor") : -1.0;
    const auto [at, added] = best.try_emplace({tested[i].candidate.info->id, rotor}, i);
    if (!added && tested[i].gain > tested[at->second].gain) at->second = i;
  }
  std::vector<std::size_t> indices;
  indices.reserve(best.size());
  for (const auto& [name, index] : best) indices.push_back(index);
  return indices;
}

RotorEvidence::RotorEvidence(RotorNormal normal, int own, const std::vector<Candidate>& candidates,
                             const RotorLibrary* library)
    : normal_(std::move(normal)), candidates_(candidates), beside_(Range(0, own)) {
  int column = own;
  for (const Candidate& candidate : candidates_) {
    first_.push_back(column);
    column += SizeOf(candidate);
  }
  TestEach();
  if (library == nullptr) return;
  double merit = 0.0;
  for (const RotorTested& t : tested_) merit = std::max(merit, t.Merit());
  Describe(*library, true, column, merit);
  Describe(*library, false, column, merit);
  if (static_cast<int>(beside_.size()) > own) TestEach();
  DescribeImplausible();
}

std::vector<int> RotorEvidence::Columns(std::size_t which) const {
  return Range(first_[which], SizeOf(candidates_[which]));
}

RotorTested RotorEvidence::TestOne(std::size_t which, const std::vector<int>& beside) const {
  const Candidate& c = candidates_[which];
  const Eigen::VectorXd ordinary = OrdinarySteps(*c.info);
  const RotorNormal normal = normal_.Select(Concatenated(beside, Columns(which)));
  const ScoreTest score = TestLast(normal, ordinary);
  const double gain = TestLast(normal, Eigen::VectorXd::Zero(ordinary.size())).chi2;
  const int tried = TriedLike(c, candidates_);
  const double p = std::min(1.0, score.p() * tried);
  return {c, c.Neutral() + SizesFromSteps(*c.info, score.value), score, gain, p, tried};
}

void RotorEvidence::TestEach() {
  tested_.clear();
  for (std::size_t i = 0; i < candidates_.size(); ++i) tested_.push_back(TestOne(i, beside_));
}

// A significant sensor term is held as a nuisance in all later tests.
void RotorEvidence::Describe(const RotorLibrary& library, bool of_sensor, int first, double merit) {
  std::vector<int> read = beside_;
  for (const RotorTerm& term : library.terms) {
    if (term.of_sensor != of_sensor) continue;
    const std::vector<int> own = Range(first + term.first, term.count);
    const ScoreTest score =
        TestLast(normal_.Select(Concatenated(beside_, own)), Eigen::VectorXd::Zero(term.count));
    described_.push_back({term.name, score.p() * static_cast<double>(library.terms.size()),
                          score.chi2 - 2.0 * term.count, of_sensor, own});
    const RotorDescribed& described = described_.back();
    if (!of_sensor || !described.Stands(kReadOff, merit)) continue;
    read = Concatenated(std::move(read), described.columns);
  }
  beside_ = std::move(read);
}

// A fitted value that no vehicle has is not named as an effect; the residual stays unexplained.
void RotorEvidence::DescribeImplausible() {
  const int ids = DistinctIds(candidates_);
  for (const RotorTested& t : tested_) {
    if (Plausible(t.candidate, t.value)) continue;
    described_.push_back({t.candidate.info->id + ", of a size or sign that no vehicle has",
                          t.p * ids,
                          t.Merit(),
                          false,
                          {}});
  }
}

std::vector<RotorPair> RotorEvidence::Pairs(double alpha, double merit) const {
  const auto stands = [&](const RotorTested& t) {
    return t.p < alpha && Plausible(t.candidate, t.value);
  };
  std::vector<RotorPair> pairs;
  const std::vector<std::size_t> distinct = BestOfEach(tested_);
  for (const std::size_t i : distinct) {
    const std::vector<int> with_i = Concatenated(beside_, Columns(i));
    for (const std::size_t j : distinct) {
      if (j <= i) continue;
      RotorPair pair{tested_[i], TestOne(j, with_i), 0.0};
      pair.merit = pair.first.Merit() + pair.second.Merit();
      if (pair.merit <= merit || !stands(pair.second)) continue;
      pair.first = TestOne(i, Concatenated(beside_, Columns(j)));
      if (stands(pair.first)) pairs.push_back(std::move(pair));
    }
  }
  return pairs;
}

}  // namespace trueline
