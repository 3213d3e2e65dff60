#include "problems/diagnosis/evidence_sum.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>

#include "problems/diagnosis/diagnosis.h"

namespace trueline {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Log density up to a constant that dimension and `dof` alone decide.
double LogDensity(const VectorXd& distance, const MatrixXd& cov, double dof) {
  const auto size = static_cast<double>(distance.size());
  const Eigen::LDLT<MatrixXd> factor(cov);
  const double square = distance.dot(factor.solve(distance));
  const double exponent =
      std::isinf(dof) ? -0.5 * square : -0.5 * (dof + size) * std::log1p(square / dof);
  return exponent - 0.5 * factor.vectorD().array().log().sum();
}

}  // namespace

VectorXd PriorSizes(const EffectInfo& info) {
  VectorXd sizes(info.parameters.size());
  for (Eigen::Index i = 0; i < sizes.size(); ++i) sizes[i] = info.parameters[i].plausible / 3.0;
  return sizes;
}

double LogRatio(const VectorXd& estimate, const MatrixXd& cov, const VectorXd& expected,
                const MatrixXd& more, double dof) {
  const double ratio =
      LogDensity(estimate - expected, cov + more, dof) - LogDensity(estimate, cov, dof);
  return std::isfinite(ratio) ? ratio : 0.0;  // what the data can't show says nothing
}

double FlightEvidenceOf(const ScoreTest& test, const VectorXd& sizes, int clusters) {
  constexpr double kExact = std::numeric_limits<double>::infinity();
  constexpr double kMost = 11.5;  // log(1e5)
  // The order of magnitude of a size is not known.
  constexpr double kShares[] = {1.0, 0.25, 0.0625};
  const VectorXd none = VectorXd::Zero(test.value.size());
  const double dof = std::max(1.0, static_cast<double>(clusters - test.value.size()));
  double mean = 0.0;  // of ratios: one, too, without an effect
  for (const double share : kShares) {
    const MatrixXd prior = (share * sizes).cwiseAbs2().asDiagonal();
    const double ratio = std::min(LogRatio(test.value, test.cov_model, none, prior, kExact),
                                  LogRatio(test.value, test.cov_cluster, none, prior, dof));
    mean += std::exp(std::min(ratio, 2.0 * kMost)) / std::size(kShares);
  }
  return std::min(kMost, std::log(mean));
}

double PriorEvidenceOf(const std::string& id, const std::vector<CandidateReport>& tried) {
  std::set<std::string> ids = {id};
  for (const CandidateReport& report : tried) ids.insert(report.id);
  const auto same =
      std::max<std::ptrdiff_t>(1, std::ranges::count(tried, id, &CandidateReport::id));
  return -std::log(static_cast<double>(ids.size()) * static_cast<double>(same));
}

double EvidenceOfChance(double p) { return -0.5 * std::log(std::max(p, 1e-300)) - std::log(2.0); }

double IndependentEvidence(const Cause& cause, const VectorXd& value, const VectorXd& sigma) {
  constexpr double kTails = 4.0;  // degrees of freedom
  if (value.size() != cause.value.size()) return 0.0;
  const Candidate& candidate = cause.candidate;
  const MatrixXd cov = (sigma.cwiseAbs2() + candidate.Ordinary().cwiseAbs2()).asDiagonal();
  const MatrixXd more = cause.sigma.cwiseAbs2().asDiagonal();
  return LogRatio(value - candidate.Neutral(), cov, cause.value - candidate.Neutral(), more,
                  kTails);
}

Cause CauseOf(const Tested& tested, int clusters) {
  const EffectInfo& info = *tested.candidate.info;
  Cause cause{tested.candidate, tested.value, tested.columns.Sizes(info, tested.test.sigma),
              tested.p,         {},           Gain(),
              Gain(),           {},           {}};
  cause.evidence.flight =
      FlightEvidenceOf(tested.test, tested.columns.Steps(info, PriorSizes(info)), clusters);
  return cause;
}

void AddIndependentEvidence(Cause* cause) {
  const Witness& witness = cause->witness;
  EvidenceSum& evidence = cause->evidence;
  evidence.witness = IndependentEvidence(*cause, witness.value, witness.sigma);
  // A stream that the fit used can contradict, but it can't say the same thing twice.
  if (!witness.independent) evidence.witness = std::min(0.0, evidence.witness);
  evidence.other_flights = 0.0;
  for (const Repeat& repeat : cause->repeats) {
    evidence.other_flights += IndependentEvidence(*cause, repeat.value, repeat.sigma);
  }
  // Another flight may lack what belongs to one.
  if (cause->candidate.info->of_one_flight) {
    evidence.other_flights = std::max(0.0, evidence.other_flights);
  }
}

}  // namespace trueline
