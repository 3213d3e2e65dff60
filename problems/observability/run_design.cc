#include "problems/observability/run_design.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "problems/common/parallel.h"
#include "problems/observability/assessment.h"
#include "problems/observability/bound_design.h"
#include "problems/observability/variational_gramian.h"
#include "problems/trajectory/limits.h"

namespace trueline {
namespace {

using Progress = std::function<void(const std::string&)>;
using DrawFlight = std::function<PiecewisePolynomial(Random*)>;

PiecewisePolynomial DrawRandom(const DesignTask& task, Random* random) {
  return RandomFeasibleFlight(task.vehicle, task.options.shape, task.options.limits, random);
}

// A Lissajous figure with its amplitude cut to the limits.
PiecewisePolynomial DrawFigure(const DesignTask& task, Random* random) {
  const Lissajous figure = RandomFigure(0.5 * task.options.limits.travel, 2.0, random);
  return ScaledToLimits(task.vehicle, LissajousPath(figure, task.options.shape.duration),
                        task.options.limits, 0.02, 2.0);
}

// Scores of `task.compare` flights, sorted.
std::vector<double> Scores(const DesignTask& task, const std::string& stream,
                           const DrawFlight& draw,
                           const std::function<double(const PiecewisePolynomial&)>& score) {
  std::vector<double> scores(task.compare);
  ParallelFor(task.compare, task.options.threads, [&](int i) {
    Random random(task.options.seed + 1000 + i, stream);
    scores[i] = score(draw(&random));
  });
  std::sort(scores.begin(), scores.end());
  return scores;
}

void Compare(const DesignTask& task, const std::function<double(const PiecewisePolynomial&)>& score,
             const Progress& progress, DesignOutcome* outcome) {
  if (task.compare == 0) return;
  progress(fmt::format("{} random flights and as many Lissajous figures", task.compare));
  outcome->random_scores = Scores(
      task, "compare", [&](Random* r) { return DrawRandom(task, r); }, score);
  outcome->lissajous_scores = Scores(
      task, "lissajous", [&](Random* r) { return DrawFigure(task, r); }, score);
}

double ExactScore(const GramianCriterion& criterion, const DesignTarget& target,
                  const RotorFlight& flight) {
  const Eigen::MatrixXd gramian =
      VariationalGramian(criterion.system, flight.Nominal(), target.weights, 0.01);
  return ScoreStates(gramian, target.interest, target.asked, target.scale).sigma_min;
}

// The exact Gramian's bounds on the states of interest.
std::vector<double> GramianBounds(const GramianCriterion& criterion, const RotorFlight& flight) {
  const RotorDrivenSystem& system = criterion.system;
  const DesignTarget& target = criterion.target;
  const Eigen::MatrixXd information =
      VariationalGramian(system, flight.Nominal(), system.OutputWeights(), 0.01);
  return SigmasOf(Assess(information, target.asked, system.errors()), target.interest);
}

DesignOutcome DesignByGramian(const DesignTask& task, const GramianCriterion& criterion,
                              const Progress& progress) {
  const DesignOptions& options = task.options;
  if (criterion.scale != ColumnScale::kTypical) {
    progress(fmt::format("{} random flights for the scale of each state", criterion.scale_flights));
  }
  DesignTarget target = criterion.target;
  target.scale = FindColumnScale(criterion.system, task.vehicle, target.asked,
                                 {criterion.scale, criterion.scale_flights, options.shape,
                                  options.limits, options.seed, options.threads});
  progress(fmt::format("design from the best {} of {} {}", options.starts, options.candidates,
                       options.random_only ? "random flights" : "random flights and figures"));
  DesignOutcome outcome{
      DesignFlight(criterion.system, task.vehicle, target, options), {}, {}, {}, {}, {}};
  const RotorFlight flight(task.vehicle, outcome.result.path);
  outcome.exact_score = ExactScore(criterion, target, flight);
  outcome.sigma = GramianBounds(criterion, flight);
  Random random(options.seed, "design");
  outcome.random_sigma =
      GramianBounds(criterion, RotorFlight(task.vehicle, DrawRandom(task, &random)));
  Compare(
      task,
      [&](const PiecewisePolynomial& path) {
        return FlightScore(criterion.system, task.vehicle, path, target);
      },
      progress, &outcome);
  return outcome;
}

// Bounds on the constants in `show`; infinite if the flight cannot be flown.
std::vector<double> ShownSigmas(const BoundDesign& design, const PiecewisePolynomial& path) {
  const std::vector<double> all = FlownSigmas(design, path);
  std::vector<double> sigma(design.show.size(), INFINITY);
  for (std::size_t i = 0; i < sigma.size() && !all.empty(); ++i) sigma[i] = all[design.show[i]];
  return sigma;
}

DesignOutcome DesignByBound(const DesignTask& task, const BoundCriterion& criterion,
                            const Progress& progress) {
  const DesignOptions& options = task.options;
  const auto started = std::chrono::steady_clock::now();
  const BoundDesign design{criterion.simulation, criterion.prior,        criterion.considered,
                           criterion.show,       options.shape.duration, criterion.ramp,
                           options.candidates,   criterion.evaluations,  options.seed,
                           options.threads};
  const auto score = [&](const PiecewisePolynomial& path) {
    return 1.0 / std::sqrt(FlownBound(design, path));
  };
  progress(fmt::format("{} Lissajous figures, the best of which is evolved on {} flights",
                       design.candidates, design.evaluations));
  const DesignedFigure figure = DesignFigure(design, progress);
  Random random(options.seed, "design");
  DesignOutcome outcome{
      {figure.path,
       CheckLimits(RotorFlight(task.vehicle, figure.path), options.limits, options.check_step),
       score(figure.path),
       1.0 / std::sqrt(figure.start_bound),
       design.evaluations,
       false,
       0.0,
       {}},
      {},
      {},
      {},
      ShownSigmas(design, figure.path),
      ShownSigmas(design, DrawRandom(task, &random))};
  outcome.result.seconds = SecondsSince(started);
  Compare(task, score, progress, &outcome);
  return outcome;
}

}  // namespace

DesignOutcome RunDesignTask(const DesignTask& task, const Progress& progress) {
  if (const auto* gramian = std::get_if<GramianCriterion>(&task.criterion)) {
    return DesignByGramian(task, *gramian, progress);
  }
  return DesignByBound(task, std::get<BoundCriterion>(task.criterion), progress);
}

}  // namespace trueline
