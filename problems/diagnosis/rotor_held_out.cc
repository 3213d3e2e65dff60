// Errors of the rotor-driven model on the half of a flight that it was not fitted to.
#include <Eigen/Cholesky>
#include <algorithm>

#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/rotor_flight.h"
#include "problems/result/statistics.h"
#include "problems/rotor/rotor_state.h"

namespace trueline {
namespace {

// The share of a step of the constants, at most 1, that leaves mass and inertia a fifth of their
// values. Half a flight may show inertia so badly that the whole step, which is linear, makes it
// negative.
double ShareWithinBody(const RotorConstants& from, const RotorConstants& step) {
  constexpr double kLeastLeft = 0.2;
  double share = 1.0;
  for (const int i :
       {kMassConstant, kInertiaConstants, kInertiaConstants + 1, kInertiaConstants + 2}) {
    if (step[i] < 0.0) share = std::min(share, (1.0 - kLeastLeft) * from[i] / -step[i]);
  }
  return std::max(share, 0.0);
}

}  // namespace

RotorDrivenFlight::PartFit RotorDrivenFlight::FitOf(const std::vector<Found>& found,
                                                    const std::vector<bool>& used) const {
  const RotorNormal normal = Normal().Only(used);
  Eigen::VectorXd z = normal.M().ldlt().solve(-normal.b());
  const RotorPrior& prior = fit_.setup->prior;
  const std::vector<int> free = prior.Free();
  RotorConstants step = RotorConstants::Zero();
  for (std::size_t i = 0; i < free.size(); ++i) {
    step[free[i]] = z[static_cast<int>(i)] * prior.sigma[free[i]];
  }
  const double share = ShareWithinBody(fit_.batch.mean, step);
  z *= share;
  PartFit part{fit_.batch.mean + share * step, {}};
  const auto fit = Linearise({}, false);
  for (std::size_t k = 0; k < found.size(); ++k) {
    const Eigen::VectorXd steps = z(fit->found[k].columns);
    const Eigen::VectorXd sizes = steps.cwiseProduct(fit->found[k].unit);
    part.effects.push_back(found[k].candidate.At(found[k].value + sizes));
  }
  return part;
}

// Open-loop position errors after half a second, by the cluster in which they start: means over
// starts. None of a half where the filter diverges with the other half's fit.
HeldOutErrors RotorDrivenFlight::ErrorsHeldOut(const std::vector<Found>& found,
                                               bool /*with_false_data*/) const {
  constexpr double kHorizon = 0.5;  // s
  constexpr double kSpacing = 0.1;  // s
  constexpr int kFewestOfHalf = 5;  // clusters that both halves need for a fit
  HeldOutErrors errors;
  errors.metric = "open_loop_position_error_0.5s";
  const int count = clusters();
  if (count < 2 * kFewestOfHalf) return errors;
  for (const int half : {0, 1}) {
    std::vector<bool> used;
    used.reserve(static_cast<std::size_t>(count));
    for (int c = 0; c < count; ++c) used.push_back(HalfOf(c) != half);
    PartFit part = FitOf(found, used);
    const RotorSetup setup = MakeRotorSetup(log_, options_, *lagged_, part.effects);
    part.constants = setup.prior.WithKnown(part.constants);
    const double start = setup.data->poses.front().t;
    const double length = setup.data->poses.back().t - start;
    std::map<int, std::vector<double>> by_cluster;
    for (const OpenLoopError& e :
         PredictOpenLoop(setup.model, *setup.data, options_.noise, part.constants, part.constants,
                         {kHorizon}, kSpacing)) {
      const int cluster = std::min(count - 1, static_cast<int>((e.t - start) / length * count));
      if (HalfOf(cluster) == half) by_cluster[cluster].push_back(e.error);
    }
    for (const auto& [cluster, values] : by_cluster) errors.arcs[cluster] = Mean(values);
  }
  return errors;
}

}  // namespace trueline
