#include "problems/calibration/conflict.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "problems/calibration/estimators.h"
#include "problems/effects/declaration.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kContradicts = 4.0;  // standard deviations
constexpr double kShows = 0.999;      // of the prior's variance: what stays above it shows nothing

struct Normal {
  double mean, variance;
};

// A sum of independent normal estimates of one number.
struct Pooled {
  double precision = 0.0, weighted = 0.0;

  void Add(const Normal& estimate) {
    precision += 1.0 / estimate.variance;
    weighted += estimate.mean / estimate.variance;
  }
  Normal Sum() const { return {weighted / precision, 1.0 / precision}; }
};

// The estimate without its prior. The estimate is the mean of data and prior, weighted by the
// precisions of the noise model. What widened its sigma beyond that belongs to the data.
void AddWithoutPrior(const ParameterEstimate& estimate, const ParameterPrior& prior, Pooled* data) {
  const double model_sigma = estimate.model_sigma > 0.0 ? estimate.model_sigma : estimate.sigma;
  const double P = prior.sigma * prior.sigma, C = model_sigma * model_sigma;
  if (!(C < kShows * P)) return;
  const double share = 1.0 - C / P;  // of the data
  const double more = std::max(0.0, estimate.sigma * estimate.sigma - C);
  data->Add(
      {prior.mean + (estimate.value - prior.mean) / share, C / share + more / (share * share)});
}

// None if the data show nothing.
std::optional<Normal> SumOf(const Pooled& data) {
  if (data.precision <= 0.0) return std::nullopt;
  return data.Sum();
}

// What the estimates show of one parameter.
std::optional<Normal> ShownBy(const std::vector<Estimates>& flight, int parameter,
                              const ParameterPrior& prior) {
  Pooled data;
  for (const Estimates& estimates : flight) {
    for (const ParameterEstimate& estimate : estimates) {
      if (estimate.name == kTheta[parameter].name) AddWithoutPrior(estimate, prior, &data);
    }
  }
  return SumOf(data);
}

Statements Compare(const std::string& name, const std::string& unit, const Normal& one,
                   const Normal& other) {
  return {name, unit, one.mean, std::sqrt(one.variance), other.mean, std::sqrt(other.variance)};
}

Statements Compare(int parameter, const Normal& one, const Normal& other) {
  return Compare(kTheta[parameter].name, kTheta[parameter].unit, one, other);
}

Normal DistributionOf(const ParameterPrior& prior) {
  return {prior.mean, prior.sigma * prior.sigma};
}

std::string WhyNotUsed(const Statements& c, const char* contradicts) {
  return fmt::format(
      "the model's {} of {:.4g} +- {:.2g} {} {}, which alone shows {:.4g} +- {:.2g}: the model's "
      "constants are not used as a prior",
      c.name, c.one, c.one_sigma, c.unit, contradicts, c.other, c.other_sigma);
}

}  // namespace

double Statements::Sigmas() const {
  return std::abs(one - other) / std::hypot(one_sigma, other_sigma);
}

bool Statements::Contradict() const { return Sigmas() >= kContradicts; }

std::vector<Estimates> IndependentEstimates(const EstimatorRun& run) {
  std::vector<Estimates> estimates;
  for (std::size_t k = run.windows.size(); k > 0;) {
    const WindowEstimate& window = run.windows[k - 1];
    estimates.push_back(window.parameters);
    if (FindEstimator(run.estimator).carries_past) break;
    k -= std::min(k, static_cast<std::size_t>(std::max(1, window.gamma)));
  }
  return estimates;
}

std::vector<Statements> CompareWithModel(const MotionPriors& model, const MotionPriors& fitted_with,
                                         const std::vector<Estimates>& flight) {
  std::vector<Statements> compared;
  for (int i = 0; i < kMotionSize; ++i) {
    if (!IsVehicle(i)) continue;
    const auto shown = ShownBy(flight, i, fitted_with[i]);
    if (shown) compared.push_back(Compare(i, DistributionOf(model[i]), *shown));
  }
  return compared;
}

std::vector<Statements> ContradictionsAmong(std::vector<Statements> compared) {
  std::erase_if(compared, [](const Statements& c) { return !c.Contradict(); });
  return compared;
}

bool ContradictTogether(const std::vector<Statements>& compared,
                        const Eigen::MatrixXd& correlations) {
  if (std::ranges::any_of(compared, &Statements::Contradict)) return true;
  const double chance = std::erfc(kContradicts / std::numbers::sqrt2);
  const auto n = static_cast<Eigen::Index>(compared.size());
  if (n == 0) return false;
  Eigen::VectorXd difference(n), one_sigma(n), other_sigma(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    difference[i] = compared[i].other - compared[i].one;
    one_sigma[i] = compared[i].one_sigma;
    other_sigma[i] = compared[i].other_sigma;
  }
  // Each in units of its difference's standard deviation.
  const Eigen::VectorXd unit = (one_sigma.cwiseAbs2() + other_sigma.cwiseAbs2()).cwiseSqrt();
  const Eigen::VectorXd share = other_sigma.cwiseQuotient(unit);
  Eigen::MatrixXd cov = share.asDiagonal() * correlations * share.asDiagonal();
  cov.diagonal().setOnes();
  const Eigen::VectorXd sigmas = difference.cwiseQuotient(unit);
  return ChiSquareTail(sigmas.dot(cov.ldlt().solve(sigmas)), static_cast<double>(n)) < chance;
}

std::vector<std::string> WhyModelIsNotUsed(const std::vector<Statements>& compared) {
  std::vector<std::string> texts;
  for (const Statements& c : ContradictionsAmong(compared)) {
    texts.push_back(WhyNotUsed(c, "contradicts this flight"));
  }
  if (!texts.empty()) return texts;
  const auto most = std::ranges::max_element(compared, {}, &Statements::Sigmas);
  if (most == compared.end()) {
    return {"the model's constants contradict this flight and are not used as a prior"};
  }
  return {WhyNotUsed(*most, "and its other constants together contradict this flight")};
}

std::string EffectsNotUsed(const std::vector<Effect>& effects) {
  std::vector<std::string> words;
  words.reserve(effects.size());
  for (const Effect& effect : effects) words.push_back(InWords(effect));
  return fmt::format(
      "with the model's effects its constants contradict this flight, without them they agree: the "
      "effects are not used ({}); trueline diagnose tells which of them this flight has",
      fmt::join(words, ", "));
}

std::vector<Statements> ConflictsBetween(const MotionPriors& priors, const Estimates& one,
                                         const Estimates& other) {
  std::vector<Statements> compared;
  for (int i = 0; i < kMotionSize; ++i) {
    if (!IsAirframe(i)) continue;
    const auto a = ShownBy({one}, i, priors[i]), b = ShownBy({other}, i, priors[i]);
    if (a && b) compared.push_back(Compare(i, *a, *b));
  }
  return ContradictionsAmong(std::move(compared));
}

namespace {

ParameterPrior PriorOf(const RotorPrior& prior, int constant) {
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  return {prior.mean[constant], prior.sigma[constant], -kUnbounded, kUnbounded};
}

ParameterEstimate EstimateOf(const RotorBatchResult& batch, int constant) {
  const RotorConstantInfo& info = kRotorConstants[constant];
  return {info.name, batch.mean[constant],       batch.Sigma()[constant], info.unit,
          "",        batch.noise_sigma[constant]};
}

bool ChangesPrior(const RotorPrior& model, const RotorPrior& fitted_with, int constant) {
  return model.mean[constant] != fitted_with.mean[constant] ||
         model.sigma[constant] != fitted_with.sigma[constant];
}

}  // namespace

std::vector<Statements> CompareWithModel(const RotorPrior& model, const RotorPrior& fitted_with,
                                         const RotorBatchResult& flight) {
  std::vector<Statements> compared;
  for (const int i : fitted_with.Free()) {
    if (!ChangesPrior(model, fitted_with, i)) continue;
    Pooled data;
    const ParameterEstimate estimate = EstimateOf(flight, i);
    AddWithoutPrior(estimate, PriorOf(fitted_with, i), &data);
    const auto shown = SumOf(data);
    if (!shown) continue;
    compared.push_back(
        Compare(estimate.name, estimate.unit, DistributionOf(PriorOf(model, i)), *shown));
  }
  return compared;
}

bool Contradicts(const RotorPrior& model, const RotorPrior& fitted_with,
                 const RotorBatchResult& flight) {
  const std::vector<Statements> compared = CompareWithModel(model, fitted_with, flight);
  std::vector<int> constants;
  for (const Statements& s : compared) constants.push_back(FindRotorConstant(s.name));
  const Eigen::VectorXd per_sigma = flight.Sigma()(constants).cwiseInverse();
  return ContradictTogether(compared, per_sigma.asDiagonal() *
                                          Eigen::MatrixXd(flight.cov(constants, constants)) *
                                          per_sigma.asDiagonal());
}

RotorPrior WithoutModel(RotorPrior configured, const RotorPrior& with_model) {
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    if (configured.sigma[i] > 0.0 || configured.mean[i] != 0.0) continue;
    if (with_model.sigma[i] > 0.0) {
      configured.sigma[i] = std::abs(with_model.mean[i]) + with_model.sigma[i];
    } else {
      configured.mean[i] = with_model.mean[i];
    }
  }
  return configured;
}

}  // namespace trueline
