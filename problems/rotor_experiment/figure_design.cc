#include "problems/rotor_experiment/figure_design.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/common/parallel.h"
#include "problems/common/random.h"
#include "problems/rotor_experiment/flown.h"
#include "problems/trajectory/evolve.h"
#include "problems/trajectory/overtones.h"

namespace trueline {
namespace {

constexpr double kYawSize = 2.0;  // rad

PiecewisePolynomial WithinLimits(const FigureDesign& design, const Overtones& figure) {
  const RotorSimulation& sim = design.simulation;
  return ScaledToLimits(sim.vehicle.model, sim.vehicle.parameters,
                        OvertonePath(figure, design.duration), sim.limits, 0.02, 2.0);
}

// `path` as large as its limits allow on a finer grid.
PiecewisePolynomial Checked(const FigureDesign& design, const PiecewisePolynomial& path) {
  const RotorSimulation& sim = design.simulation;
  return ScaledToLimits(sim.vehicle.model, sim.vehicle.parameters, path, sim.limits, 0.001, 1.0);
}

}  // namespace

double FlownBound(const FigureDesign& design, const PiecewisePolynomial& path) {
  constexpr double kLost = 0.1;  // m
  try {
    const RotorSimulation& sim = design.simulation;
    const Flown flown = Fly(sim, path, design.seed);
    if (flown.truth.path_error_rms > kLost) return INFINITY;
    const Eigen::MatrixXd cov = RotorBound(ModelOf(sim), flown.data, {sim.noise, design.prior},
                                           flown.nodes, flown.truth.constants);
    double sum = 0.0;
    for (const int i : design.by) sum += cov(i, i) / std::pow(design.prior.sigma[i], 2);
    return sum / static_cast<double>(design.by.size());
  } catch (const InputError&) {  // the vehicle lost it
    return INFINITY;
  }
}

PiecewisePolynomial DesignFigure(const FigureDesign& design,
                                 const std::function<void(const std::string&)>& progress) {
  const double size = 0.5 * design.simulation.limits.travel;
  const auto figure = [&](int i) {
    Random random(design.seed + i, "figure");
    return OvertonesOf(RandomFigure(size, kYawSize, &random));
  };
  const auto cost = [&](const Eigen::VectorXd& x) {
    return FlownBound(design, WithinLimits(design, x));
  };
  std::vector<double> costs(design.best_of);
  ParallelFor(design.best_of, design.threads, [&](int i) { costs[i] = cost(figure(i)); });
  const auto best = std::min_element(costs.begin(), costs.end()) - costs.begin();
  if (!std::isfinite(costs[best])) {
    throw InputError(fmt::format("none of {} figures can be flown; raise best_of", design.best_of));
  }
  const Overtones start = figure(static_cast<int>(best));
  if (design.evaluations == 0) return Checked(design, WithinLimits(design, start));
  const Evolved evolved = Evolve(cost, start, OvertoneUnits(size, kYawSize),
                                 {design.evaluations, 12, 0.1, design.seed, design.threads});
  progress(fmt::format("bound {:.1f} % of that of the best figure",
                       100.0 * std::sqrt(evolved.value / costs[best])));
  return Checked(design, WithinLimits(design, evolved.x));
}

}  // namespace trueline
