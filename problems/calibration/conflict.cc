#include "problems/calibration/conflict.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "problems/calibration/estimators.h"

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

void AddWithoutPrior(const std::vector<ParameterEstimate>& estimates, int parameter,
                     const ParameterPrior& prior, Pooled* data) {
  for (const ParameterEstimate& estimate : estimates) {
    if (estimate.name == kTheta[parameter].name) AddWithoutPrior(estimate, prior, data);
  }
}

// None if the data show nothing.
std::optional<Normal> SumOf(const Pooled& data) {
  if (data.precision <= 0.0) return std::nullopt;
  return data.Sum();
}

// What windows that share no data show of one parameter.
std::optional<Normal> ShownBy(const EstimatorRun& run, int parameter, const ParameterPrior& prior) {
  Pooled data;
  for (std::size_t k = run.windows.size(); k > 0;) {
    const WindowEstimate& window = run.windows[k - 1];
    AddWithoutPrior(window.parameters, parameter, prior, &data);
    if (FindEstimator(run.estimator).carries_past) break;
    k -= std::min(k, static_cast<std::size_t>(std::max(1, window.gamma)));
  }
  return SumOf(data);
}

void AddConflict(int parameter, const Normal& one, const Normal& other,
                 std::vector<Conflict>* conflicts) {
  const double sigma = std::sqrt(one.variance + other.variance);
  if (std::abs(one.mean - other.mean) < kContradicts * sigma) return;
  conflicts->push_back({kTheta[parameter].name, kTheta[parameter].unit, one.mean,
                        std::sqrt(one.variance), other.mean, std::sqrt(other.variance)});
}

}  // namespace

std::vector<Conflict> ConflictsWithPrior(const std::array<ParameterPrior, kMotionSize>& priors,
                                         const EstimatorRun& run) {
  std::vector<Conflict> conflicts;
  for (int i = 0; i < kMotionSize; ++i) {
    if (!IsVehicle(i)) continue;
    const auto flight = ShownBy(run, i, priors[i]);
    const double variance = priors[i].sigma * priors[i].sigma;
    if (flight) AddConflict(i, {priors[i].mean, variance}, *flight, &conflicts);
  }
  return conflicts;
}

std::vector<Conflict> ConflictsBetween(const std::array<ParameterPrior, kMotionSize>& priors,
                                       const std::vector<ParameterEstimate>& one,
                                       const std::vector<ParameterEstimate>& other) {
  const auto shown_by = [&](const std::vector<ParameterEstimate>& estimates, int parameter) {
    Pooled data;
    AddWithoutPrior(estimates, parameter, priors[parameter], &data);
    return SumOf(data);
  };
  std::vector<Conflict> conflicts;
  for (int i = 0; i < kMotionSize; ++i) {
    if (!IsAirframe(i)) continue;
    const auto a = shown_by(one, i), b = shown_by(other, i);
    if (a && b) AddConflict(i, *a, *b, &conflicts);
  }
  return conflicts;
}

}  // namespace trueline
