#include "problems/rotor_diagnosis/rotor_search.h"

namespace trueline {
namespace {

void Scale(const Eigen::VectorXd& unit, ScoreTest* test) {
  test->value = test->value.cwiseProduct(unit);
  test->sigma = test->sigma.cwiseProduct(unit);
  test->cov_model = unit.asDiagonal() * test->cov_model * unit.asDiagonal();
  test->cov_cluster = unit.asDiagonal() * test->cov_cluster * unit.asDiagonal();
}

}  // namespace

RotorEvidence RotorSearch::TestAll(const std::vector<Candidate>& candidates) const {
  const RotorLibrary library = MakeRotorLibrary(*world_);
  return EvidenceWith(&library, candidates);
}

std::vector<RotorTested> RotorSearch::Test(const std::vector<Candidate>& candidates) const {
  return EvidenceWith(nullptr, candidates).tested();
}

RotorEvidence RotorSearch::EvidenceWith(const RotorLibrary* library,
                                        const std::vector<Candidate>& candidates) const {
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
  const int own = static_cast<int>(variants.size());
  for (const Candidate& candidate : candidates) add(candidate, candidate.Neutral(), effects_);
  RotorNormal normal(world_->model, world_->data, BatchOptions(), batch_,
                     ColumnsOf(*world_, std::move(variants), library), kRotorCluster);
  return {std::move(normal), own, candidates, library};
}

ScoreTest RotorSearch::TestFoundBeside(const std::vector<RotorFound>& found, std::size_t which,
                                       const RotorNormal& normal, std::vector<int> beside) const {
  std::vector<int> own;
  int at = 0;
  for (std::size_t k = 0; k < found.size(); ++k) {
    for (int i = 0; i < found[k].value.size(); ++i) (k == which ? own : beside).push_back(at++);
  }
  beside.insert(beside.end(), own.begin(), own.end());
  const Candidate& candidate = found[which].candidate;
  const Eigen::VectorXd unit = ColumnUnits(*candidate.info);
  const Eigen::VectorXd ordinary = candidate.Ordinary();
  ScoreTest test = TestLast(normal.Select(beside), ordinary.cwiseQuotient(unit));
  Scale(unit, &test);
  // The test judges the total value: the fitted one plus the step that the nuisance columns cause.
  test.value += found[which].value - candidate.Neutral();
  test.Judge(test.value, clusters());
  return test;
}

}  // namespace trueline
