#include "problems/rotor_diagnosis/rotor_gain.h"

#include <algorithm>
#include <map>

#include "problems/result/bootstrap.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr int kBlockClusters = 3;
constexpr double kHorizon = 0.5;  // s
constexpr double kSpacing = 0.1;  // s
constexpr double kFewest = 5;     // clusters that both folds need for a fit

// Constants and causes fitted to the clusters in `used` only.
struct Fold {
  RotorConstants constants;
  std::vector<Effect> effects;
};

Fold FitFold(const RotorNormal& normal, const RotorSearch& search,
             const std::vector<RotorFound>& found) {
  const Eigen::VectorXd z = normal.M().ldlt().solve(-normal.b());
  const std::vector<int> free = search.world().prior.Free();
  Fold fold{search.batch().mean, {}};
  for (std::size_t i = 0; i < free.size(); ++i) {
    fold.constants[free[i]] += z[static_cast<int>(i)] * search.world().prior.sigma[free[i]];
  }
  int at = normal.constants();
  for (const RotorFound& f : found) {
    Eigen::VectorXd steps = z.segment(at, f.value.size());
    at += static_cast<int>(f.value.size());
    fold.effects.push_back(
        f.candidate.At(f.value + ColumnUnits(*f.candidate.info).cwiseProduct(steps)));
  }
  return fold;
}

// Errors of the held-out clusters, by cluster.
std::map<int, std::vector<double>> Errors(const RotorWorld& world, const RotorSearch& search,
                                          const RotorConstants& constants,
                                          const std::vector<bool>& used) {
  const double start = world.data.poses.front().t;
  const double length = world.data.poses.back().t - start;
  const int count = static_cast<int>(used.size());
  std::map<int, std::vector<double>> errors;
  for (const OpenLoopError& e : PredictOpenLoop(world.model, world.data, search.noise(), constants,
                                                constants, {kHorizon}, kSpacing)) {
    const int cluster = std::min(count - 1, static_cast<int>((e.t - start) / length * count));
    if (!used[cluster]) errors[cluster].push_back(e.error);
  }
  return errors;
}

}  // namespace

Gain MeasureRotorGain(const FlightLog& log, const RotorSearch& search,
                      const std::vector<RotorFound>& found) {
  Gain gain;
  gain.metric = "open_loop_position_error_0.5s";
  const int clusters = search.clusters();
  if (clusters < 2 * kFewest) return gain;
  RotorSearch base(search, log);  // the same noise, so the models differ by the causes only
  std::vector<RotorFound> none;
  base.Refit(none);
  std::vector<std::vector<double>> differences;
  std::vector<double> before, after;
  for (const int fold : {0, 1}) {
    std::vector<bool> used;
    for (int c = 0; c < clusters; ++c) used.push_back((c / kBlockClusters) % 2 != fold);
    const Fold plain = FitFold(base.normal().Only(used), base, none);
    const Fold extended = FitFold(search.normal().Only(used), search, found);
    const RotorWorld world = MakeRotorWorld(log, search.options(), extended.effects);
    RotorConstants constants = extended.constants;
    const RotorPrior& prior = world.prior;
    for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
      if (prior.sigma[i] == 0.0) constants[i] = prior.mean[i];
    }
    const auto errors_before = Errors(base.world(), base, plain.constants, used);
    for (const auto& [cluster, errors] : Errors(world, search, constants, used)) {
      if (errors_before.count(cluster) == 0) continue;
      before.push_back(Mean(errors_before.at(cluster)));
      after.push_back(Mean(errors));
      differences.push_back({before.back() - after.back()});
    }
  }
  gain.arcs = static_cast<int>(differences.size());
  const auto interval = BootstrapInterval(differences, Mean);
  if (!interval) return Gain();
  gain.before = Mean(before);
  gain.after = Mean(after);
  gain.low = interval->low;
  gain.high = interval->high;
  return gain;
}

}  // namespace trueline
