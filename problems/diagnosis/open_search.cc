#include "problems/diagnosis/open_search.h"

#include <algorithm>
#include <cmath>

#include "problems/diagnosis/score_test.h"
#include "problems/result/distributions.h"

namespace trueline {
namespace {

using Eigen::VectorXd;

constexpr int kMostTerms = 3;
constexpr int kChunk = 128;     // columns at a time: the cost of a chunk grows with its square
constexpr double kAlike = 6.0;  // of the gain
constexpr std::size_t kTestedAgain = 6;

// A size of no interest: 0.005 m/s^2, 0.05 rad/s^2 or 0.5 mrad in the root mean square. A term is
// reported from about five times that on.
double OrdinarySize(const OpenTerm& term, const std::vector<TermMotion>& flight) {
  double sum = 0.0;
  for (const TermMotion& at : flight) sum += term.At(at).squaredNorm();
  const double rms = std::sqrt(sum / static_cast<double>(flight.size()));
  const double least = term.on == TermOn::kForce ? 0.005 : term.on == TermOn::kTurn ? 0.05 : 5e-4;
  return least / std::max(rms, 1e-9);
}

struct TestedOpenTerm {
  const OpenTerm* term;
  double ordinary = 0.0;
  ScoreTest test = {};
  std::array<SizeWithSigma, 2> halves = {};
  double p = 1.0;

  double gain() const { return std::min(test.gain, test.chi2_cluster); }
  // Each half predicts the other one better.
  bool Repeats() const {
    const auto gains = [](const SizeWithSigma& of, const SizeWithSigma& by) {
      return by.value * (2.0 * of.value - by.value) > 0.0;
    };
    return gains(halves[0], halves[1]) && gains(halves[1], halves[0]);
  }
};

// Tests the column. The scatter between clusters counts as that of as many clusters as share the
// information: a hump that the flight crosses three times has three.
void Test(const Linearisation& fit, const std::vector<int>& nuisances, int tested,
          TestedOpenTerm* t) {
  constexpr int kBlocks = 4;
  const auto width = fit.b().size();
  const Eigen::LDLT<Eigen::MatrixXd> nn(Eigen::MatrixXd(fit.M()(nuisances, nuisances)));
  const VectorXd of_tested = fit.M().col(tested)(nuisances);
  VectorXd column = VectorXd::Zero(width + 1), residual = column;
  column(nuisances) = -nn.solve(of_tested);
  column[tested] = 1.0;
  residual(nuisances) = -nn.solve(VectorXd(fit.b()(nuisances)));
  residual[width] = 1.0;
  const VectorXd scores = fit.ClusterProducts(residual, column);
  const VectorXd information = fit.ClusterProducts(column, column);
  std::array<double, 2> score = {}, weight = {}, scatter = {};
  const Eigen::Index clusters = scores.size();
  const auto half = [&](Eigen::Index c) { return (kBlocks * c / clusters) % 2; };
  for (Eigen::Index c = 0; c < clusters; ++c) {
    score[half(c)] += scores[c];
    weight[half(c)] += information[c];
  }
  std::array<SizeWithSigma, 2>& sizes = t->halves;
  for (int h = 0; h < 2; ++h) {
    if (weight[h] > 0.0) sizes[h].value = -score[h] / weight[h];
  }
  for (Eigen::Index c = 0; c < clusters; ++c) {
    const double left = scores[c] + information[c] * sizes[half(c)].value;
    scatter[half(c)] += left * left;
  }
  for (int h = 0; h < 2; ++h) {
    if (!(weight[h] > 0.0)) continue;
    sizes[h].sigma = std::sqrt(std::max(scatter[h] / weight[h], 1.0) / weight[h]);
  }
  t->test = TestColumns(fit, nuisances, {tested}, VectorXd::Constant(1, t->ordinary));
  const double sharing = std::pow(information.sum(), 2) / information.squaredNorm();
  t->p = std::max(t->test.p(), FTail(t->test.chi2_cluster, 1, std::max(1.0, sharing - 1.0)));
}

class OpenSearch {
 public:
  explicit OpenSearch(const DiagnosedFlight& flight)
      : flight_(flight), motions_(flight.Motions()), terms_(OpenTerms(flight.drive(), motions_)) {}

  OpenCatalogue Run(double alpha) {
    OpenCatalogue result;
    std::vector<OpenTerm> chosen;
    while (static_cast<int>(chosen.size()) < kMostTerms) {
      std::vector<TestedOpenTerm> tested = TestAll(chosen);
      if (chosen.empty()) result.tested = Sizes(tested);
      const TestedOpenTerm* best = Best(&tested, chosen, alpha);
      if (best == nullptr) break;
      result.described.push_back(Described(*best, tested));
      chosen.push_back(*best->term);
    }
    return result;
  }

 private:
  std::vector<TestedOpenTerm> TestAll(const std::vector<OpenTerm>& chosen) const {
    std::vector<TestedOpenTerm> tested;
    for (std::size_t begin = 0; begin < terms_.size(); begin += kChunk) {
      const std::size_t end = std::min(terms_.size(), begin + kChunk);
      std::vector<OpenTerm> columns = chosen;
      columns.insert(columns.end(), terms_.begin() + static_cast<long>(begin),
                     terms_.begin() + static_cast<long>(end));
      const auto fit = flight_.LineariseTerms(columns);
      const auto beside = Concatenated(fit->nuisances, Range(fit->terms.front().columns.front(),
                                                             static_cast<int>(chosen.size())));
      for (std::size_t i = begin; i < end; ++i) {
        const int column = fit->terms[chosen.size() + i - begin].columns.front();
        tested.push_back({&terms_[i], OrdinarySize(terms_[i], motions_)});
        TestedOpenTerm& t = tested.back();
        Test(*fit, beside, column, &t);
      }
    }
    return tested;
  }

  // Noise that was learned without a term contains what it explains: the best are tested again.
  void Relearn(const std::vector<OpenTerm>& chosen, std::vector<TestedOpenTerm*>* best) const {
    std::vector<OpenTerm> columns = chosen;
    for (const TestedOpenTerm* t : *best) columns.push_back(*t->term);
    const auto fit = flight_.LineariseTerms(columns);
    std::vector<std::vector<int>> sets;
    for (std::size_t i = 0; i < best->size(); ++i) {
      std::vector<int> set;
      for (std::size_t k = 0; k < chosen.size(); ++k) set.push_back(fit->terms[k].columns.front());
      set.push_back(fit->terms[chosen.size() + i].columns.front());
      sets.push_back(set);
    }
    const auto relearned = fit->Relearn(sets);
    for (std::size_t i = 0; i < relearned.size(); ++i) {
      const Linearisation& again = *relearned[i].fit;
      std::vector<int> columns_of = again.candidates.front().columns;
      const int tested = columns_of.back();
      columns_of.pop_back();
      const auto beside = Concatenated(again.nuisances, columns_of);
      TestedOpenTerm& t = *(*best)[i];
      Test(again, beside, tested, &t);
    }
  }

  static std::vector<TermSize> Sizes(const std::vector<TestedOpenTerm>& tested) {
    std::vector<TermSize> sizes;
    for (const TestedOpenTerm& t : tested) {
      sizes.push_back({t.term->Name(), t.term->Unit(), {t.test.value[0], t.test.sigma[0]}, t.p});
    }
    return sizes;
  }

  const TestedOpenTerm* Best(std::vector<TestedOpenTerm>* tested,
                             const std::vector<OpenTerm>& chosen, double alpha) const {
    std::vector<TestedOpenTerm*> order;
    for (TestedOpenTerm& t : *tested) order.push_back(&t);
    const auto by_gain = [](const TestedOpenTerm* a, const TestedOpenTerm* b) {
      return a->gain() > b->gain();
    };
    std::sort(order.begin(), order.end(), by_gain);
    order.resize(std::min(order.size(), kTestedAgain));
    Relearn(chosen, &order);
    const double each = alpha / static_cast<double>(terms_.size());
    std::erase_if(order, [&](const TestedOpenTerm* t) { return t->p >= each || !t->Repeats(); });
    if (order.empty()) return nullptr;
    std::sort(order.begin(), order.end(), by_gain);
    const double least = order.front()->gain() - kAlike;
    std::erase_if(order, [&](const TestedOpenTerm* t) { return t->gain() < least; });
    const auto shortest = std::min_element(order.begin(), order.end(),
                                           [](const TestedOpenTerm* a, const TestedOpenTerm* b) {
                                             return a->term->Length() < b->term->Length();
                                           });
    return *shortest;
  }

  DescribedTerm Described(const TestedOpenTerm& best,
                          const std::vector<TestedOpenTerm>& tested) const {
    const int count = static_cast<int>(terms_.size());
    DescribedTerm described{*best.term,
                            {best.test.value[0], best.test.sigma[0]},
                            std::min(1.0, best.p * count),
                            count,
                            best.halves,
                            {},
                            {}};
    for (const TestedOpenTerm& t : tested) {
      if (t.term != best.term && t.gain() > best.gain() - kAlike) {
        described.alike.push_back(t.term->Name());
      }
    }
    return described;
  }

  const DiagnosedFlight& flight_;
  std::vector<TermMotion> motions_;
  std::vector<OpenTerm> terms_;
};

}  // namespace

OpenCatalogue DescribeMisfit(const DiagnosedFlight& flight, double alpha) {
  return OpenSearch(flight).Run(alpha);
}

void AddTermRepeats(const DiagnosedFlight& other, std::vector<DescribedTerm>* terms) {
  if (terms->empty()) return;
  constexpr double kRepeatAlpha = 0.05;
  std::vector<OpenTerm> columns;
  for (const DescribedTerm& t : *terms) columns.push_back(t.term);
  const auto fit = other.LineariseTerms(columns);
  for (std::size_t i = 0; i < terms->size(); ++i) {
    DescribedTerm& t = (*terms)[i];
    std::vector<int> beside = fit->nuisances;
    for (std::size_t k = 0; k < terms->size(); ++k) {
      if (k != i) beside.push_back(fit->terms[k].columns.front());
    }
    const ScoreTest test = TestColumns(*fit, beside, fit->terms[i].columns, VectorXd::Zero(1));
    TermRepeat repeat{other.log().name, {test.value[0], test.sigma[0]}, false};
    const double ratio = repeat.size.value / t.size.value;
    const double apart = std::abs(repeat.size.value - t.size.value);
    repeat.repeats =
        test.p() < kRepeatAlpha && ratio > 0.0 &&
        ((ratio > 0.5 && ratio < 2.0) || apart < 2.0 * std::hypot(repeat.size.sigma, t.size.sigma));
    t.repeats.push_back(repeat);
  }
}

}  // namespace trueline
