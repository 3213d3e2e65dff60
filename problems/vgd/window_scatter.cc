#include "problems/vgd/window_scatter.h"

#include <algorithm>
#include <cmath>

namespace trueline {
namespace {

constexpr double kExpected = 2.0;  // windows that an expectation of one counts as
// Share of the variance that the prior takes at most. Where the data say nothing, every window
// repeats the prior's mean, and its scatter is nothing divided by nothing.
constexpr double kMostByPrior = 0.95;

using Estimates = std::vector<std::vector<ParameterEstimate>>;  // by window and parameter

// The variance with which a window's estimate scatters about the truth: the prior draws it to its
// mean, so it scatters by less than its sigma.
double VarianceOfScatter(double sigma, double prior_sigma) {
  const double by_prior = std::min(kMostByPrior, std::pow(sigma / prior_sigma, 2));
  return sigma * sigma * (1.0 - by_prior);
}

// Indices of the window and of those before it that share no pass with each other. A window reaches
// further back than gamma passes where these hold too few fixes, so its own count tells where the
// next may end. Windows of fewer passes, at the flight's start, are left out.
std::vector<std::size_t> DisjointWindows(const std::vector<WindowEstimate>& windows,
                                         std::size_t window, int gamma) {
  std::vector<std::size_t> indices{window};
  for (std::size_t i = window; i-- > 0;) {
    const WindowEstimate& after = windows[indices.back()];
    const bool is_before = windows[i].tau <= after.tau - after.gamma;
    if (is_before && windows[i].gamma >= gamma) indices.push_back(i);
  }
  return indices;
}

// The factor on the sigma of parameter `p` by the scatter of these windows; at least 1.
double Factor(const Estimates& estimates, const std::vector<std::size_t>& windows, std::size_t p,
              double prior_sigma) {
  double weights = 0.0, mean = 0.0, squares = 0.0;
  for (const std::size_t i : windows) {
    const ParameterEstimate& estimate = estimates[i][p];
    const double weight = 1.0 / VarianceOfScatter(estimate.sigma, prior_sigma);
    weights += weight;
    const double off = estimate.value - mean;
    mean += off * weight / weights;
    squares += weight * off * (estimate.value - mean);
  }
  const double others = static_cast<double>(windows.size()) - 1.0;
  return std::sqrt(std::max(1.0, (kExpected + squares) / (kExpected + others)));
}

// reference: the prior's sigma that a status refers to; that of a --model is tighter.
void Widen(double factor, double prior_sigma, double reference, ParameterEstimate* estimate) {
  const double most = std::max(estimate->sigma, prior_sigma);
  estimate->sigma = std::min(factor * estimate->sigma, most);
  if (estimate->status == "identified" && estimate->sigma > 0.5 * reference) {
    estimate->status = "weak";
  }
}

}  // namespace

void WidenByScatter(const VgdOptions& options, EstimatorRun* run) {
  const VgdOptions ranges;  // of Table 2
  Estimates stated;
  for (const WindowEstimate& estimate : run->windows) stated.push_back(estimate.parameters);
  for (std::size_t window = 0; window < run->windows.size(); ++window) {
    const std::vector<std::size_t> windows = DisjointWindows(run->windows, window, options.gamma);
    if (windows.size() < 2) continue;
    std::vector<ParameterEstimate>& parameters = run->windows[window].parameters;
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      const int parameter = static_cast<int>(p);
      if (!IsVehicle(parameter)) continue;
      const double prior_sigma = options.PriorOf(parameter).sigma;
      const double reference = std::max(prior_sigma, ranges.PriorOf(parameter).sigma);
      Widen(Factor(stated, windows, p, prior_sigma), prior_sigma, reference, &parameters[p]);
    }
  }
}

}  // namespace trueline
