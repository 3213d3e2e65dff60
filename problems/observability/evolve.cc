#include "problems/observability/evolve.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "problems/common/parallel.h"
#include "problems/common/random.h"

namespace trueline {
namespace {

using Eigen::VectorXd;

constexpr int kOffspring = 12;  // of a generation, evaluated in parallel

// Weights and rates as in Hansen's tutorial (table 1), those of the covariance raised by
// (n + 2) / 3 for its diagonal alone (Ros and Hansen, eq. 6).
struct EvolutionRates {
  EvolutionRates(int n, int parents) : weights(parents) {
    for (int i = 0; i < parents; ++i) weights[i] = std::log(parents + 0.5) - std::log(i + 1.0);
    weights /= weights.sum();
    mass = 1.0 / weights.squaredNorm();
    path = 4.0 / (n + 4.0);
    step_path = (mass + 2.0) / (n + mass + 3.0);
    const double diagonal = (n + 2.0) / 3.0;
    one = diagonal * 2.0 / (std::pow(n + 1.3, 2) + mass);
    rank = std::min(1.0 - one,
                    diagonal * 2.0 * (mass - 2.0 + 1.0 / mass) / (std::pow(n + 2, 2) + mass));
    walk = std::sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
  }
  VectorXd weights;
  double mass, path, step_path, one, rank;
  double walk;  // mean norm of n standard normal numbers
};

}  // namespace

Evolved Evolve(const std::function<double(const VectorXd&)>& cost, const VectorXd& start,
               const VectorXd& unit, const EvolveOptions& options) {
  const int n = static_cast<int>(start.size()), parents = kOffspring / 2;
  const EvolutionRates rates(n, parents);
  Random random(options.seed, "evolve");
  Evolved best{start, cost(start)};
  VectorXd mean = start, variance = unit.cwiseAbs2();
  VectorXd path = VectorXd::Zero(n), step_path = path;
  double step = options.step;
  for (int tried = 1; tried < options.evaluations; tried += kOffspring) {
    std::vector<VectorXd> moves(kOffspring, VectorXd(n));
    for (VectorXd& move : moves) {
      for (int j = 0; j < n; ++j) move[j] = std::sqrt(variance[j]) * random.Normal();
    }
    std::vector<double> values(kOffspring);
    ParallelFor(kOffspring, options.threads,
                [&](int i) { values[i] = cost(mean + step * moves[i]); });
    std::vector<int> order(kOffspring);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return values[a] < values[b]; });
    if (values[order[0]] < best.value) best = {mean + step * moves[order[0]], values[order[0]]};
    VectorXd shift = VectorXd::Zero(n), spread = VectorXd::Zero(n);
    for (int i = 0; i < parents; ++i) {
      shift += rates.weights[i] * moves[order[i]];
      spread += rates.weights[i] * moves[order[i]].cwiseAbs2();
    }
    mean += step * shift;
    const auto follow = [&](double rate) { return std::sqrt(rate * (2.0 - rate) * rates.mass); };
    step_path = (1.0 - rates.step_path) * step_path +
                follow(rates.step_path) * shift.cwiseQuotient(variance.cwiseSqrt());
    path = (1.0 - rates.path) * path + follow(rates.path) * shift;
    variance = (1.0 - rates.one - rates.rank) * variance + rates.one * path.cwiseAbs2() +
               rates.rank * spread;
    const double damping = 1.0 + rates.step_path;
    step *= std::exp(rates.step_path / damping * (step_path.norm() / rates.walk - 1.0));
    const int done = std::min(tried + kOffspring, options.evaluations);
    const bool tenth = 10 * done / options.evaluations > 10 * tried / options.evaluations;
    if (options.watch && tenth) options.watch(done, best.value);
  }
  return best;
}

}  // namespace trueline
