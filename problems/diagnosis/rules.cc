#include "problems/diagnosis/rules.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "problems/diagnosis/linearisation.h"
#include "problems/result/distributions.h"

namespace trueline {
namespace {

constexpr int kFewestIndependent = 5;  // arcs or replays
// Of the size that the test finds with 95 % power. Most false causes beside effects hidden in
// measured flights were smaller; few true ones were, and a witness shows those.
constexpr double kLeastShown = 1.0;

double Ratio(const Gain& g) { return g.arcs > 0 ? g.after / g.before : 1.0; }
// The bound that lies on one side of the mean with 95 % is nearer than that of the two-sided
// interval: by this factor for a normal distribution, by less for Student's.
constexpr double kOneSided = 0.84;
double MeanOf(const Gain& g) { return g.before - g.after; }
bool Worse(const Gain& g) { return g.arcs > 0 && -MeanOf(g) > kOneSided * (g.high - MeanOf(g)); }
bool Better(const Gain& g) { return g.arcs > 0 && MeanOf(g) > kOneSided * (MeanOf(g) - g.low); }

bool Witnessed(const Cause& cause) { return cause.witness.says == "confirms"; }

// True if, on held-out flight, the witness's stream agrees better with mocap once the cause is
// corrected, by more than positions lose.
bool AgreesBetter(const Cause& cause) {
  const double all = Ratio(cause.gain) * Ratio(cause.open_loop) * Ratio(cause.agreement);
  return Better(cause.agreement) && all <= 1.0;
}

}  // namespace

bool ClearGain(const Gain& arcs, const Gain& replays) {
  return (Better(arcs) || Better(replays)) && !PredictsWorse(arcs, replays);
}

bool PredictsWorse(const Gain& arcs, const Gain& replays) {
  return Ratio(arcs) * Ratio(replays) > 1.0;
}

bool ClearLoss(const Gain& arcs, const Gain& replays) {
  const bool better = Better(arcs) || Better(replays);
  return (Worse(arcs) || Worse(replays)) && !better && PredictsWorse(arcs, replays);
}

bool Harmful(const Cause& cause) {
  // A small loss is no evidence against a cause: laps repeat, so an unmodelled effect may favour
  // the worse model slightly on both halves, and positions do not show every sensor error.
  constexpr double kCertain = 1e-12;  // p-value of a cause that is certain
  const double limit = cause.p < kCertain ? 1.25 : 1.1;
  const Gain &arcs = cause.gain, &replays = cause.open_loop;
  const bool clear = Worse(arcs) || Worse(replays) || !(Better(arcs) || Better(replays));
  return clear && Ratio(arcs) * Ratio(replays) > limit;
}

bool Refuted(const Cause& cause) { return cause.witness.says == "refutes"; }

bool NamesMore(const std::vector<Cause>& next, const std::vector<Cause>& best) {
  const auto names = [](const std::vector<Cause>& causes, const Cause& cause) {
    return std::any_of(causes.begin(), causes.end(),
                       [&](const Cause& c) { return c.candidate.info == cause.candidate.info; });
  };
  const auto is_more = [&](const Cause& c) {
    return !names(best, c) && ClearGain(c.gain, c.open_loop);
  };
  return std::all_of(best.begin(), best.end(), [&](const Cause& c) { return names(next, c); }) &&
         std::any_of(next.begin(), next.end(), is_more);
}

std::vector<Cause>::iterator MostRefuted(std::vector<Cause>* causes) {
  auto most = causes->end();
  double least = 0.0;
  for (auto cause = causes->begin(); cause != causes->end(); ++cause) {
    if (!Refuted(*cause)) continue;
    const Eigen::VectorXd neutral = cause->candidate.Neutral(), size = cause->value - neutral;
    const double share = size.dot(cause->witness.value - neutral) / size.squaredNorm();
    if (most != causes->end() && share >= least) continue;
    most = cause;
    least = share;
  }
  return most;
}

std::string WhyNotNamed(const Cause& cause, bool gains) {
  if (Refuted(cause)) return "refuted by a witness: " + cause.witness.text;
  if (!gains) return "";
  const bool no_loss = !PredictsWorse(cause.gain, cause.open_loop);
  const bool repeats = cause.confirmed.value_or(false);
  if (Witnessed(cause)) {
    // The sensor has the error, but it is not what the model lacks on this flight. A loss that may
    // be chance is no evidence of that, unless another flight does not have the error. Nor is one
    // where the corrected sensor agrees better with mocap: positions hide an error that another
    // one cancels.
    const bool contradicted = cause.confirmed.has_value() && !repeats;
    const bool clear = ClearLoss(cause.gain, cause.open_loop) && !AgreesBetter(cause);
    const bool lost = clear || (contradicted && !no_loss);
    if (lost) return "its witness shows it, but held-out flight is predicted worse";
    if (!repeats && Worse(cause.agreement)) {
      return "the corrected sensor agrees worse with mocap on held-out flight";
    }
    return "";
  }
  if (cause.times_detectable < kLeastShown && !repeats) {
    return fmt::format("of {:.2f} times the size that this flight shows with good chance",
                       cause.times_detectable);
  }
  if (Harmful(cause)) return "held-out flight is predicted worse with it";
  // An error that is the same on all flights repeats as well, but gains nothing.
  if (no_loss && repeats) return "";
  const int independent = std::max(cause.gain.independent, cause.open_loop.independent);
  if (independent < kFewestIndependent) {
    return fmt::format("only {} independent arcs or replays are behind it, {} are needed",
                       independent, kFewestIndependent);
  }
  if (ClearGain(cause.gain, cause.open_loop)) return "";
  return "neither held-out flight nor a witness nor another flight shows it: its gain may be zero "
         "or less";
}

bool Claimed(const Cause& cause) { return cause.confirmed.value_or(true) || Witnessed(cause); }

std::string VerdictOf(const std::vector<Cause>& causes, const std::vector<Cause>& set_aside,
                      const std::vector<std::string>& unexplained_by, bool terms_repeat) {
  if (causes.empty() && !terms_repeat && set_aside.empty() && unexplained_by.empty())
    return "clean";
  // A cause that can't be relied on is a significant misfit, too.
  const bool all = std::all_of(causes.begin(), causes.end(), Claimed);
  if ((causes.empty() && !terms_repeat) || !all || !unexplained_by.empty()) return "unexplained";
  const bool ambiguous = std::any_of(causes.begin(), causes.end(),
                                     [](const Cause& c) { return !c.confused_with.empty(); });
  return ambiguous ? "ambiguous" : "explained";
}

std::vector<std::string> ConfusedConstants(const Linearisation& fit,
                                           const std::vector<Found>& found, std::size_t which,
                                           const std::vector<std::string>& names) {
  constexpr double kOpened = 0.01;  // of a prior's precision
  constexpr double kChance = 0.05;  // above: the size without priors is not significant
  constexpr double kCorrelated = 0.7;
  const std::vector<int> nuisances = fit.Beside(which);
  const EffectColumns& own = fit.found[which];
  const std::vector<int> all = Concatenated(nuisances, own.columns);
  Eigen::MatrixXd M = fit.M()(all, all);
  const auto size = static_cast<Eigen::Index>(own.columns.size());
  // Constants are in units of their prior sigma, so their priors add one.
  M.diagonal().head(static_cast<Eigen::Index>(names.size())).array() -= 1.0 - kOpened;
  const Eigen::MatrixXd cov = M.ldlt().solve(Eigen::MatrixXd::Identity(M.rows(), M.cols()));
  const Candidate& candidate = found[which].candidate;
  const Eigen::VectorXd steps =
      own.Steps(*candidate.info, found[which].value - candidate.Neutral());
  const double chi2 = steps.dot(cov.bottomRightCorner(size, size).ldlt().solve(steps));
  std::vector<std::string> confused;
  if (ChiSquareTail(chi2, static_cast<double>(size)) < kChance) return confused;
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

}  // namespace trueline
