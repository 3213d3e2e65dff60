#include "problems/diagnosis/rules.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "problems/diagnosis/evidence_sum.h"
#include "problems/diagnosis/rounds.h"
#include "problems/diagnosis/thresholds.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

double Ratio(const Gain& g) { return g.arcs > 0 ? g.after / g.before : 1.0; }
// The bound that lies on one side of the mean with 95 % is nearer than that of the two-sided
// interval: by this factor for a normal distribution, by less for Student's.
double OneSided() {
  return std::sqrt(ChiSquareCritical(2.0 * kSingleAlpha, 1.0) /
                   ChiSquareCritical(kSingleAlpha, 1.0));
}
double MeanOf(const Gain& g) { return g.before - g.after; }
bool Worse(const Gain& g) { return g.arcs > 0 && -MeanOf(g) > OneSided() * (g.high - MeanOf(g)); }
bool Better(const Gain& g) { return g.arcs > 0 && MeanOf(g) > OneSided() * (MeanOf(g) - g.low); }

bool Better(const Gains& gains) { return Better(gains.arcs) || Better(gains.replays); }

bool PredictsWorse(const Gains& gains) { return Ratio(gains.arcs) * Ratio(gains.replays) > 1.0; }

// Adds the terms that no other flight contradicts.
void ChooseTerms(const std::vector<Found>& terms, Diagnosis* diagnosis, std::vector<Found>* model) {
  std::size_t next = 0;
  for (DescribedTerm& t : diagnosis->open.described) {
    if (!t.in_model) continue;
    t.in_model = t.confirmed.value_or(true);
    if (t.in_model) model->push_back(terms[next]);
    ++next;
  }
}

void AddTermsToModel(const std::vector<Found>& model, std::size_t first, Diagnosis* diagnosis) {
  for (const DescribedTerm& t : diagnosis->open.described) {
    if (!t.in_model) continue;
    Effect effect = model[first++].effect();
    effect.values["sigma"] = t.size.sigma;
    diagnosis->in_model.push_back(effect);
  }
}

}  // namespace

double EvidenceNeeded(double alpha) { return -std::log(alpha); }

std::string PartsText(const EvidenceSum& evidence) {
  std::vector<std::string> parts;
  for (const auto& [name, part] : evidence.Parts()) {
    if (part != 0.0) parts.push_back(fmt::format("{} {:+.1f}", name, part));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

bool ClearGain(const Gains& gains) { return Better(gains) && !PredictsWorse(gains); }

bool ClearLoss(const Gains& gains) {
  return (Worse(gains.arcs) || Worse(gains.replays)) && !Better(gains) && PredictsWorse(gains);
}

bool Refuted(const Cause& cause, double alpha) {
  const EvidenceSum& e = cause.evidence;
  return e.Total() < EvidenceNeeded(alpha) && e.flight + e.prior >= EvidenceNeeded(alpha);
}

std::string WhyNotNamed(const Cause& cause, double alpha) {
  if (cause.evidence.Total() >= EvidenceNeeded(alpha)) return "";
  std::string why =
      fmt::format("its evidence is {:.1f} ({}), and {:.1f} is needed", cause.evidence.Total(),
                  PartsText(cause.evidence), EvidenceNeeded(alpha));
  const bool against = cause.evidence.witness < 0.0 || cause.witness.says == "refutes";
  if (against) why += "; " + cause.witness.text;
  return why;
}

void AddOthersEvidence(const SearchOptions& options, Cause* cause) {
  AddIndependentEvidence(cause);
  const auto change = options.against ? ChangeEvidence(*cause) : std::nullopt;
  if (!change) return;
  EvidenceSum& evidence = cause->evidence;
  cause->shared = std::ranges::count(cause->repeats, "repeats", &Repeat::outcome) > 0 &&
                  *change + evidence.prior < EvidenceNeeded(options.alpha);
  if (cause->shared) return;
  evidence.flight = std::min(evidence.flight, *change);
  evidence.other_flights = 0.0;
}

bool Claimed(const Cause& cause) {
  return cause.confirmed.value_or(true) || cause.witness.says == "confirms";
}

std::string VerdictOf(const std::vector<Cause>& causes, const std::vector<Cause>& set_aside,
                      const std::vector<std::string>& unexplained_by, double alpha,
                      bool terms_repeat) {
  // A source speaks of it, although all together do not show it.
  const auto speaks = [&](const Cause& c) {
    return Refuted(c, alpha) || WitnessAlone(c) + c.evidence.prior >= EvidenceNeeded(alpha);
  };
  const bool misfit = !unexplained_by.empty() || std::ranges::any_of(set_aside, speaks);
  if (causes.empty() && !terms_repeat && !misfit) return "clean";
  // A cause that can't be relied on is a significant misfit, too.
  const bool all = std::ranges::all_of(causes, Claimed);
  if ((causes.empty() && !terms_repeat) || !all || !unexplained_by.empty()) return "unexplained";
  const bool ambiguous =
      std::ranges::any_of(causes, [](const Cause& c) { return !c.confused_with.empty(); });
  return ambiguous ? "ambiguous" : "explained";
}

std::vector<std::string> ConfusedConstants(const Linearisation& fit,
                                           const std::vector<Found>& found, std::size_t which,
                                           const std::vector<std::string>& names) {
  constexpr double kCorrelated = 0.7;
  const std::vector<int> nuisances = fit.Beside(which);
  const EffectColumns& own = fit.found[which];
  const std::vector<int> all = Concatenated(nuisances, own.columns);
  Eigen::MatrixXd M = fit.M()(all, all);
  const auto size = static_cast<Eigen::Index>(own.columns.size());
  // Constants are in units of their prior sigma, so their priors add one. Nearly all of it goes.
  M.diagonal().head(static_cast<Eigen::Index>(names.size())).array() -= 1.0 - kNegligible;
  const Eigen::MatrixXd cov = M.ldlt().solve(Eigen::MatrixXd::Identity(M.rows(), M.cols()));
  const Candidate& candidate = found[which].candidate;
  const Eigen::VectorXd steps =
      own.Steps(*candidate.info, found[which].value - candidate.Neutral());
  const double chi2 = steps.dot(cov.bottomRightCorner(size, size).ldlt().solve(steps));
  std::vector<std::string> confused;
  if (ChiSquareTail(chi2, static_cast<double>(size)) < kSingleAlpha) return confused;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    for (Eigen::Index i = M.rows() - size; i < M.rows(); ++i) {
      if (std::abs(cov(row, i)) < kCorrelated * std::sqrt(cov(row, row) * cov(i, i))) continue;
      confused.push_back(names[k]);
      break;
    }
  }
  return confused;
}

void WidenByChange(const std::vector<ParameterEstimate>& with,
                   std::vector<ParameterEstimate>* without) {
  for (ParameterEstimate& estimate : *without) {
    const auto before = std::ranges::find(with, estimate.name, &ParameterEstimate::name);
    if (before == with.end()) continue;
    estimate.sigma = std::hypot(estimate.sigma, estimate.value - before->value);
  }
}

void ChooseModel(const Rounds& rounds, const std::vector<Found>& terms, DiagnosedFlight* flight,
                 Diagnosis* diagnosis) {
  std::vector<Found> model = rounds.found;
  const auto& causes = diagnosis->causes;
  const std::size_t false_data = causes.size() - rounds.found.size();
  for (std::size_t i = causes.size(); i-- > 0;) {
    if (Claimed(causes[i])) {
      diagnosis->in_model.insert(diagnosis->in_model.begin(), causes[i].effect());
    } else if (i >= false_data) {
      EraseAt(i - false_data, &model);
    }
  }
  if (diagnosis->in_model.size() < causes.size()) {
    diagnosis->model_lacks = "causes that no other flight confirms";
  }
  const std::size_t chosen = model.size();
  ChooseTerms(terms, diagnosis, &model);
  if (model.size() < rounds.found.size() + terms.size()) {
    flight->Fit(&model);
    Diagnosis refitted;
    flight->Describe(&refitted);
    WidenByChange(diagnosis->parameters, &refitted.parameters);
    diagnosis->parameters = refitted.parameters;
    const std::size_t first = diagnosis->in_model.size() - chosen;
    for (std::size_t k = 0; k < chosen; ++k) {
      diagnosis->in_model[first + k] = model[k].effect();
    }
  }
  AddTermsToModel(model, chosen, diagnosis);
  const std::vector<Effect> known = flight->KnownEffects();
  diagnosis->in_model.insert(diagnosis->in_model.begin(), known.begin(), known.end());
}

}  // namespace trueline
