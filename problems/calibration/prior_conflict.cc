#include "problems/calibration/prior_conflict.h"

#include <algorithm>
#include <cmath>

namespace trueline {
namespace {

constexpr double kContradicts = 4.0;  // standard deviations
constexpr double kShows = 0.999;      // of the prior's variance: what stays above it shows nothing

// A sum of independent normal estimates of one number.
struct Pooled {
  double precision = 0.0, weighted = 0.0;

  void Add(double mean, double variance) {
    precision += 1.0 / variance;
    weighted += mean / variance;
  }
  double Mean() const { return weighted / precision; }
  double Variance() const { return 1.0 / precision; }
};

// The estimate without its prior: precisions of prior and data add up.
void AddWithoutPrior(const ParameterEstimate& estimate, const ParameterPrior& prior, Pooled* data) {
  const double P = prior.sigma * prior.sigma, C = estimate.sigma * estimate.sigma;
  if (!(C < kShows * P)) return;
  const double precision = 1.0 / C - 1.0 / P;
  data->Add((estimate.value / C - prior.mean / P) / precision, 1.0 / precision);
}

}  // namespace

std::vector<PriorConflict> ConflictsOf(const std::array<ParameterPrior, kMotionSize>& priors,
                                       const EstimatorRun& run) {
  std::vector<PriorConflict> conflicts;
  for (int i = 0; i < kMotionSize; ++i) {
    if (!IsVehicle(i)) continue;
    Pooled data;
    for (std::size_t k = run.windows.size(); k > 0;) {
      const WindowEstimate& window = run.windows[k - 1];
      for (const ParameterEstimate& estimate : window.parameters) {
        if (estimate.name == kTheta[i].name) AddWithoutPrior(estimate, priors[i], &data);
      }
      k -= std::min(k, static_cast<std::size_t>(std::max(1, window.gamma)));
    }
    if (data.precision <= 0.0) continue;
    const double variance = priors[i].sigma * priors[i].sigma + data.Variance();
    if (std::abs(data.Mean() - priors[i].mean) < kContradicts * std::sqrt(variance)) continue;
    conflicts.push_back({kTheta[i].name, kTheta[i].unit, priors[i].mean, priors[i].sigma,
                         data.Mean(), std::sqrt(data.Variance())});
  }
  return conflicts;
}

}  // namespace trueline
