#include "problems/diagnosis/evidence_sum.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "problems/diagnosis/diagnosis.h"
#include "problems/diagnosis/thresholds.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMostEvidence = 11.5;  // log(1e5), of a source that trusts one model

// Log density up to a constant that dimension and `dof` alone decide.
double LogDensity(const VectorXd& distance, const MatrixXd& cov, double dof) {
  const auto size = static_cast<double>(distance.size());
  const Eigen::LDLT<MatrixXd> factor(cov);
  const double square = distance.dot(factor.solve(distance));
  const double exponent =
      std::isinf(dof) ? -0.5 * square : -0.5 * (dof + size) * std::log1p(square / dof);
  return exponent - 0.5 * factor.vectorD().array().log().sum();
}

// Of an estimate by itself, with these variances.
double EvidenceOfSize(const Candidate& candidate, const VectorXd& size, const VectorXd& variance) {
  ScoreTest test;
  test.value = size;
  test.cov_model = test.cov_cluster = variance.asDiagonal();
  return FlightEvidenceOf(test, PriorSizes(*candidate.info));
}

}  // namespace

VectorXd PriorSizes(const EffectInfo& info) {
  return EachOf(info.parameters, &EffectParameterInfo::plausible) / kApartSigmas;
}

UnstatedErrors UnstatedErrorsOf(const Linearisation& fit, const Candidate& cause,
                                const EffectColumns& own, const std::vector<int>& beside,
                                const std::vector<Candidate>& candidates, double unstated) {
  if (unstated == 0.0) return {};
  std::map<const EffectInfo*, std::vector<std::size_t>> of_effect;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!IsOneOf(candidates[i], cause)) of_effect[candidates[i].info].push_back(i);
  }
  UnstatedErrors errors;
  for (const auto& [info, which_ones] : of_effect) {
    MatrixXd sum = MatrixXd::Zero(own.unit.size(), own.unit.size());
    for (const std::size_t i : which_ones) {
      sum += ImitatedBy(fit, beside, own.columns, fit.candidates[i].columns);
    }
    errors.emplace_back(unstated / static_cast<double>(which_ones.size()) *
                        (own.unit.asDiagonal() * sum * own.unit.asDiagonal()));
  }
  return errors;
}

VectorXd MeanSigma(const UnstatedErrors& errors, Eigen::Index size) {
  VectorXd sum = VectorXd::Zero(size);
  for (const MatrixXd& error : errors) sum += error.diagonal();
  return (sum / std::max(1.0, static_cast<double>(errors.size()))).cwiseSqrt();
}

double LogRatio(const VectorXd& estimate, const MatrixXd& cov, const VectorXd& expected,
                const MatrixXd& more, double dof, const UnstatedErrors& errors) {
  const auto density = [&](const VectorXd& distance, const MatrixXd& of) {
    if (errors.empty()) return LogDensity(distance, of, dof);
    std::vector<double> logs;
    for (const MatrixXd& error : errors) logs.push_back(LogDensity(distance, of + error, dof));
    const double most = *std::ranges::max_element(logs);
    double sum = 0.0;
    for (const double log : logs) sum += std::exp(log - most);
    return most + std::log(sum / static_cast<double>(logs.size()));
  };
  const double ratio = density(estimate - expected, cov + more) - density(estimate, cov);
  return std::isfinite(ratio) ? ratio : 0.0;  // what the data can't show says nothing
}

double FlightEvidenceOf(const ScoreTest& test, const VectorXd& sizes,
                        const UnstatedErrors& errors) {
  // The order of magnitude of a size is not known.
  constexpr double kShares[] = {1.0, 0.25, 0.0625};
  const VectorXd none = VectorXd::Zero(test.value.size());
  const double dof = test.DegreesOfFreedom(test.value);
  double mean = 0.0;  // of ratios: one, too, without an effect
  for (const double share : kShares) {
    const MatrixXd prior = (share * sizes).cwiseAbs2().asDiagonal();
    double ratio = std::min(LogRatio(test.value, test.cov_model, none, prior, INFINITY),
                            LogRatio(test.value, test.cov_cluster, none, prior, dof));
    // The strength of an unstated error is known, so its tails are not heavy.
    for (const MatrixXd* cov : {&test.cov_model, &test.cov_cluster}) {
      if (errors.empty()) break;
      ratio = std::min(ratio, LogRatio(test.value, *cov, none, prior, INFINITY, errors));
    }
    mean += std::exp(std::min(ratio, 2.0 * kMostEvidence)) / std::size(kShares);
  }
  return std::min(kMostEvidence, std::log(mean));
}

double PriorEvidenceOf(const std::string& id, const std::vector<CandidateReport>& tried) {
  std::set<std::string> ids = {id};
  for (const CandidateReport& report : tried) ids.insert(report.id);
  const auto same =
      std::max<std::ptrdiff_t>(1, std::ranges::count(tried, id, &CandidateReport::id));
  return -std::log(static_cast<double>(ids.size()) * static_cast<double>(same));
}

double HeldOutEvidence(const Gains& gains) {
  const double within = std::sqrt(ChiSquareCritical(kSingleAlpha, 1.0));  // sigmas
  double z = 0.0, measures = 0.0;
  for (const Gain* gain : {&gains.arcs, &gains.replays}) {
    const double sigma = (gain->high - gain->low) / (2.0 * within);
    if (!std::isfinite(sigma) || !(sigma > 0.0)) continue;
    z += (gain->before - gain->after) / sigma;
    measures += 1.0;
  }
  if (z >= 0.0) return 0.0;
  return std::max(-kMostEvidence, -0.5 * z * z / measures);
}

double EvidenceOfChance(double p) {
  return std::min(kMostEvidence, -0.5 * std::log(std::max(p, 1e-300)) - std::log(2.0));
}

double IndependentEvidence(const Cause& cause, const VectorXd& value, const VectorXd& sigma,
                           bool same_model) {
  if (value.size() != cause.value.size()) return 0.0;
  const Candidate& candidate = cause.candidate;
  const VectorXd unstated = cause.Unstated().cwiseAbs2();
  VectorXd cov = sigma.cwiseAbs2() + candidate.Ordinary().cwiseAbs2();
  if (same_model) cov += unstated;
  const MatrixXd more = (cause.sigma.cwiseAbs2() + unstated).asDiagonal();
  return LogRatio(value - candidate.Neutral(), cov.asDiagonal(), cause.value - candidate.Neutral(),
                  more, kTails);
}

double WitnessAlone(const Cause& cause) {
  const Candidate& candidate = cause.candidate;
  const Witness& witness = cause.witness;
  const bool says = witness.value.size() > 0 && witness.value.size() == cause.value.size();
  if (!says || !witness.independent || !Plausible(candidate, witness.value)) {
    return -INFINITY;
  }
  return EvidenceOfSize(candidate, witness.value - candidate.Neutral(),
                        witness.sigma.cwiseAbs2() + candidate.Ordinary().cwiseAbs2());
}

Cause CauseOf(const Tested& tested) {
  const EffectInfo& info = *tested.candidate.info;
  Cause cause{tested.candidate, tested.value, tested.columns.Sizes(info, tested.test.sigma),
              tested.p};
  cause.evidence.flight =
      FlightEvidenceOf(tested.test, tested.columns.Steps(info, PriorSizes(info)));
  return cause;
}

std::optional<double> ChangeEvidence(const Cause& cause) {
  const Eigen::Index size = cause.value.size();
  VectorXd mean = VectorXd::Zero(size), variance = mean, square = mean;
  double flights = 0.0;
  for (const Repeat& repeat : cause.repeats) {
    if (repeat.value.size() != size) continue;
    flights += 1.0;
    mean += repeat.value;
    square += repeat.value.cwiseAbs2();
    variance += repeat.sigma.cwiseAbs2();
  }
  if (flights == 0.0) return std::nullopt;
  mean /= flights;
  const VectorXd scatter = (square / flights - mean.cwiseAbs2()).cwiseMax(0.0);
  variance = variance / (flights * flights) + cause.sigma.cwiseAbs2() + scatter +
             2.0 * cause.candidate.Ordinary().cwiseAbs2();
  // The scatter between clusters counts in the flight's own evidence, of which and of this the
  // lesser holds.
  return EvidenceOfSize(cause.candidate, cause.value - mean, variance);
}

void AddIndependentEvidence(Cause* cause) {
  const Witness& witness = cause->witness;
  EvidenceSum& evidence = cause->evidence;
  evidence.witness = IndependentEvidence(*cause, witness.value, witness.sigma, false);
  // A stream that the fit used can contradict, but it can't say the same thing twice.
  if (!witness.independent) evidence.witness = std::min(0.0, evidence.witness);
  evidence.other_flights = 0.0;
  for (const Repeat& repeat : cause->repeats) {
    evidence.other_flights += IndependentEvidence(*cause, repeat.value, repeat.sigma, true);
  }
  // Another flight may lack what belongs to one.
  if (cause->candidate.info->of_one_flight) {
    evidence.other_flights = std::max(0.0, evidence.other_flights);
  }
}

}  // namespace trueline
