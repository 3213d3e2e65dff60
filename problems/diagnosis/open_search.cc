// Search of the open catalogue: which terms describe what the causes leave.
#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "problems/common/parallel.h"
#include "problems/diagnosis/diagnosed_flight.h"
#include "problems/diagnosis/open_term.h"
#include "problems/diagnosis/score_test.h"
#include "problems/diagnosis/thresholds.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

using Eigen::VectorXd;

constexpr int kMostTerms = 3;
constexpr std::size_t kMostRejected = 4;  // by the fit with them in the model
constexpr int kChunk = 128;  // columns at a time: the cost of a chunk grows with its square
constexpr double kNearlyShown = 100.0;  // of the level: noise that is learned again changes p
// Of the logarithm of how many times as much scores scatter between clusters as the noise model
// says: half normal. Of 2,269 tests on a measured nano-drone flight, 1 % exceed 4.3 times, on
// simulated flights 1.4 to 1.7 times.
const double kSpread = std::log(2.0);

struct TestedOpenTerm {
  TermForm term = {};
  double ordinary = 0.0;
  ScoreTest test = {};
  std::array<SizeWithSigma, 2> halves = {};
  // Share of its information that the constants do not imitate. Of a moment with the pitch rate,
  // beside a constant for just that, nothing is left, and its size says nothing.
  double own = 1.0;
  double p = 1.0;
  double sigma = 0.0;  // of test.value; with few clusters larger than test.sigma

  // Terms compete by the likelihood. The scatter between clusters says what is significant.
  double gain() const { return test.gain; }
  // Each half predicts the other one better.
  bool Repeats() const {
    const auto gains = [](const SizeWithSigma& of, const SizeWithSigma& by) {
      return by.value * (2.0 * of.value - by.value) > 0.0;
    };
    return gains(halves[0], halves[1]) && gains(halves[1], halves[0]);
  }
  // The scatter between clusters counts as that of as many clusters as share the information: a
  // hump that the flight crosses three times has three. So few do not show the scatter; then
  // kSpread says how large it may be.
  void Judge() {
    const double ratio = test.cov_cluster(0, 0) / test.cov_model(0, 0);
    const double sharing = test.Sharing(Eigen::VectorXd::Ones(1));
    const UncertainSigma scatter(ratio, std::max(0.0, sharing - 1.0), kSpread);
    p = std::max(test.p(), scatter.Tail(std::sqrt(test.chi2)));
    sigma = test.sigma[0] * scatter.Factor() / std::max(1.0, std::sqrt(ratio));
    JudgeHalves();
  }
  // The sizes by blocks of the flight in turn.
  void JudgeHalves() {
    constexpr int kBlocks = 4;
    const Eigen::Index clusters = test.information.rows();
    const auto half = [&](Eigen::Index c) { return (kBlocks * c / clusters) % 2; };
    std::array<double, 2> score = {}, weight = {}, scatter = {};
    for (Eigen::Index c = 0; c < clusters; ++c) {
      score[half(c)] += test.scores(c, 0);
      weight[half(c)] += test.information(c, 0);
    }
    for (Eigen::Index c = 0; c < clusters; ++c) {
      const int h = static_cast<int>(half(c));
      const double left = test.scores(c, 0) - test.information(c, 0) * score[h] / weight[h];
      scatter[h] += left * left;
    }
    for (int h = 0; h < 2; ++h) {
      if (!(weight[h] > 0.0)) continue;
      halves[h].value = test.value[0] - score[h] / weight[h];
      halves[h].sigma = std::sqrt(std::max(scatter[h] / weight[h], 1.0) / weight[h]);
    }
  }
};

void Test(const Linearisation& fit, const std::vector<int>& nuisances, int tested,
          TestedOpenTerm* t) {
  t->own = OwnShare(fit, nuisances, tested);
  t->test = TestColumns(fit, nuisances, {tested}, VectorXd::Constant(1, t->ordinary));
  t->Judge();
}

class OpenSearch {
 public:
  // `found`: the causes of the last Fit.
  OpenSearch(DiagnosedFlight* flight, std::vector<Found>* found)
      : flight_(*flight),
        found_(*found),
        causes_(found->size()),
        motions_(flight->Motions()),
        terms_(OpenTerms({flight->drive(), flight->log(), motions_})) {}

  OpenCatalogue Run(double alpha) {
    OpenCatalogue result;
    each_ = alpha / static_cast<double>(terms_.size());
    while (static_cast<int>(result.described.size()) < kMostTerms) {
      std::vector<TestedOpenTerm> tested = TestAll();
      if (result.tested.empty()) result.tested = Sizes(tested);
      AddRefined(&tested);
      if (!AddBest(&tested, &result.described)) break;
    }
    return result;
  }

 private:
  // The best term that the model keeps once the flight is fitted with it. One that it does not
  // keep, because its constants take over what the term says, may hide another: a force with the
  // sideways speed one with the roll rate. False if there is none.
  bool AddBest(std::vector<TestedOpenTerm>* tested, std::vector<DescribedTerm>* described) {
    while (rejected_.size() < kMostRejected) {
      const TestedOpenTerm* best = Best(tested);
      if (best == nullptr) return false;
      described->push_back(Described(*best, *tested));
      if (Add(*best, described)) return true;
    }
    return false;
  }

  std::vector<TestedOpenTerm> TestAll() const {
    std::vector<TestedOpenTerm> tested;
    for (std::size_t begin = 0; begin < terms_.size(); begin += kChunk) {
      const std::size_t end = std::min(terms_.size(), begin + kChunk);
      const std::vector<TermForm> chunk(terms_.begin() + static_cast<long>(begin),
                                        terms_.begin() + static_cast<long>(end));
      for (TestedOpenTerm& t : TestEach(chunk)) tested.push_back(std::move(t));
    }
    return tested;
  }

  std::vector<TestedOpenTerm> TestEach(const std::vector<TermForm>& terms) const {
    const auto fit = flight_.LineariseTerms(Concatenated(beside_, terms));
    std::vector<int> nuisances = fit->nuisances;
    for (std::size_t k = 0; k < beside_.size(); ++k) {
      nuisances.push_back(fit->terms[k].columns.front());
    }
    std::vector<TestedOpenTerm> tested(terms.size());
    ParallelFor(static_cast<int>(terms.size()), FreeCores(), [&](int i) {
      tested[i].term = terms[i];
      tested[i].ordinary = OrdinarySize(terms[i], motions_);
      Test(*fit, nuisances, fit->terms[beside_.size() + i].columns.front(), &tested[i]);
    });
    return tested;
  }

  // Noise that was learned without a term contains what it explains: the best are tested again.
  void Relearn(std::vector<TestedOpenTerm*>* best) const {
    std::vector<TermForm> columns = beside_;
    for (const TestedOpenTerm* t : *best) columns.push_back(t->term);
    const auto fit = flight_.LineariseTerms(columns);
    std::vector<std::vector<int>> sets;
    for (std::size_t i = 0; i < best->size(); ++i) {
      std::vector<int> set;
      for (std::size_t k = 0; k < beside_.size(); ++k) set.push_back(fit->terms[k].columns.front());
      set.push_back(fit->terms[beside_.size() + i].columns.front());
      sets.push_back(set);
    }
    const auto relearned = fit->Relearn(sets);
    for (std::size_t i = 0; i < relearned.size(); ++i) {
      const Linearisation& again = *relearned[i].fit;
      std::vector<int> columns_of = again.candidates.front().columns;
      const int tested = columns_of.back();
      columns_of.pop_back();
      Test(again, Concatenated(again.nuisances, columns_of), tested, (*best)[i]);
    }
  }

  static std::vector<TermSize> Sizes(const std::vector<TestedOpenTerm>& tested) {
    std::vector<TermSize> sizes;
    sizes.reserve(tested.size());
    for (const TestedOpenTerm& t : tested) {
      sizes.push_back({t.term.Name(), t.term.Unit(), {t.test.value[0], t.sigma}, t.p});
    }
    return sizes;
  }

  // The best of those that are shown, or nearly, and that the constants do not imitate.
  std::vector<TestedOpenTerm*> ByGain(std::vector<TestedOpenTerm>* tested) const {
    std::vector<TestedOpenTerm*> order;
    for (TestedOpenTerm& t : *tested) {
      const bool shown = t.p < kNearlyShown * each_ && t.own >= kNegligible;
      if (shown && !rejected_.contains(t.term.Name())) order.push_back(&t);
    }
    std::ranges::sort(order, std::greater<>(), &TestedOpenTerm::gain);
    order.resize(std::min(order.size(), kRelearned));
    return order;
  }

  // Adds the humps that the best terms point to. The grid gives their places roughly, and a slope
  // may fit better than a hump that is not quite at its place.
  void AddRefined(std::vector<TestedOpenTerm>* tested) const {
    std::vector<TermForm> starts;
    for (const TestedOpenTerm* t : ByGain(tested)) {
      for (const TermForm& hump : HumpsToldBy(t->term)) starts.push_back(hump);
    }
    if (starts.empty()) return;
    std::vector<TestedOpenTerm> humps = TestEach(starts);
    const auto best = ByGain(&humps);
    for (std::size_t i = 0; i < std::min(best.size(), kTriedByFit); ++i) {
      tested->push_back(Refined(*best[i]));
    }
  }

  // The hump near this one that fits best.
  TestedOpenTerm Refined(const TestedOpenTerm& place) const {
    TestedOpenTerm best = place;
    double step = 0.5;  // of the radius
    for (int i = 0; i < kMostIterations && step >= 0.25; ++i) {
      const std::vector<TestedOpenTerm> tested = TestEach(NearbyHumps(best.term, motions_, step));
      const auto next = std::ranges::max_element(tested, {}, &TestedOpenTerm::gain);
      best = *next;
      if (next == tested.begin()) step *= 0.5;
    }
    return best;
  }

  const TestedOpenTerm* Best(std::vector<TestedOpenTerm>* tested) const {
    std::vector<TestedOpenTerm*> order = ByGain(tested);
    Relearn(&order);
    std::erase_if(order, [&](const TestedOpenTerm* t) {
      return t->p >= each_ || !t->Repeats() || t->own < kNegligible;
    });
    if (order.empty()) return nullptr;
    std::ranges::sort(order, std::greater<>(), &TestedOpenTerm::gain);
    const double least = order.front()->gain() - kAsGood;
    std::erase_if(order, [&](const TestedOpenTerm* t) { return t->gain() < least; });
    return *std::ranges::min_element(order, {},
                                     [](const TestedOpenTerm* t) { return t->term.Length(); });
  }

  DescribedTerm Described(const TestedOpenTerm& best,
                          const std::vector<TestedOpenTerm>& tested) const {
    const int count = static_cast<int>(terms_.size());
    DescribedTerm described{best.term,
                            {best.test.value[0], best.sigma},
                            std::min(1.0, best.p * count),
                            count,
                            best.halves};
    for (const TestedOpenTerm& t : tested) {
      const std::string name = t.term.Name();
      const bool alike = name != best.term.Name() && t.gain() > best.gain() - kAsGood;
      if (alike && std::ranges::count(described.alike, name) == 0) described.alike.push_back(name);
    }
    return described;
  }

  // Fits the flight with the last of `described` in the model. Terms in the model that are then not
  // significant, or whose halves disagree, are dropped; false if the new one is. A term beside
  // which less than half of a named cause is left stays a column beside the model.
  bool Add(const TestedOpenTerm& term, std::vector<DescribedTerm>* described) {
    described->back().term = term.term;
    if (!flight_.CanModel(term.term)) {
      beside_.push_back(term.term);
      return true;
    }
    described->back().in_model = true;
    const std::vector<Found> before = found_;
    found_.push_back({Candidate::OfTerm(term.term, term.ordinary), term.test.value});
    const std::size_t added = found_.size() - 1;
    flight_.Fit(&found_);
    if (const Candidate* cause = TakenOver(before)) {
      described->back().in_model = false;
      described->back().instead_of = cause->Label();
      beside_.push_back(term.term);
      found_ = before;
      flight_.Fit(&found_);
      return true;
    }
    if (!IsShownInModel(added, described)) {
      Drop(added, described);
      return false;
    }
    for (std::size_t k = added; k-- > causes_;) {
      if (!IsShownInModel(k, described)) Drop(k, described);
    }
    return true;
  }

  // The first cause of which less than half is left in the model.
  const Candidate* TakenOver(const std::vector<Found>& before) const {
    for (std::size_t k = 0; k < causes_; ++k) {
      const Candidate& cause = found_[k].candidate;
      const VectorXd steps = cause.EachOf(&EffectParameterInfo::step);
      const VectorXd none = cause.Neutral();
      if (ShareLeft(found_[k].value - none, before[k].value - none, steps) < kMostOf) return &cause;
    }
    return nullptr;
  }

  // Tests a term in the model, and stores its size.
  bool IsShownInModel(std::size_t k, std::vector<DescribedTerm>* described) const {
    const auto fit = flight_.Linearise({}, false);
    TestedOpenTerm t{*found_[k].candidate.term};
    t.test = TestFound(*fit, found_, k);
    t.Judge();
    DescribedTerm& of = *InModel(k, described);
    of.size = {found_[k].value[0], t.sigma};
    of.p = std::min(1.0, t.p * of.tried);
    of.halves = t.halves;
    return t.p < each_ && t.Repeats();
  }

  // The entry of a term in the model: they come in the same order.
  std::vector<DescribedTerm>::iterator InModel(std::size_t k,
                                               std::vector<DescribedTerm>* described) const {
    std::size_t left = k - causes_;
    return std::find_if(described->begin(), described->end(),
                        [&](const DescribedTerm& d) { return d.in_model && left-- == 0; });
  }

  // And those that are not shown without it. They are not tried again: two terms that take each
  // other's place would come and go without end.
  void Drop(std::size_t k, std::vector<DescribedTerm>* described) {
    rejected_.insert(found_[k].candidate.term->Name());
    described->erase(InModel(k, described));
    EraseAt(k, &found_);
    flight_.Fit(&found_);
    for (std::size_t left = causes_; left < found_.size(); ++left) {
      if (!IsShownInModel(left, described)) return Drop(left, described);
    }
  }

  DiagnosedFlight& flight_;
  std::vector<Found>& found_;
  std::size_t causes_;
  std::vector<TermMotion> motions_;
  std::vector<TermForm> terms_;
  std::vector<TermForm> beside_;    // columns beside the model, which can't have them
  std::set<std::string> rejected_;  // names
  double each_ = 0.0;
};

}  // namespace

OpenCatalogue DescribeMisfit(DiagnosedFlight* flight, std::vector<Found>* found, double alpha) {
  return OpenSearch(flight, found).Run(alpha);
}

}  // namespace trueline
