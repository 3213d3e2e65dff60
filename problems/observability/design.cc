#include "problems/observability/design.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "problems/common/parallel.h"
#include "problems/common/units.h"
#include "problems/observability/assessment.h"
#include "problems/observability/design_score.h"
#include "problems/observability/e2log.h"
#include "problems/trajectory/limits.h"

namespace trueline {
namespace {

constexpr double kPenaltyStep = 0.05;
constexpr double kMargin = 0.01;

using Clock = std::chrono::steady_clock;

// -log(score) + rho * penalty.
class PenalisedScore : public ceres::FirstOrderFunction {
 public:
  PenalisedScore(const DesignScore& score, const LimitPenalty& penalty, double rho)
      : score_(score), penalty_(penalty), rho_(rho) {}
  int NumParameters() const override { return kFlatOutputs * score_.shape().num_free(); }
  bool Evaluate(const double* x, double* cost, double* gradient) const override {
    const FlatMatrix free =
        Eigen::Map<const FlatMatrix>(x, kFlatOutputs, score_.shape().num_free());
    FlatMatrix slope, penalty_slope;
    const bool wanted = gradient != nullptr;
    const double score = score_.Evaluate(free, wanted ? &slope : nullptr);
    *cost = rho_ * penalty_.Evaluate(free, wanted ? &penalty_slope : nullptr) - score;
    if (!std::isfinite(*cost)) return false;
    if (!wanted) return true;
    Eigen::Map<FlatMatrix>(gradient, kFlatOutputs, free.cols()) = rho_ * penalty_slope - slope;
    return Eigen::Map<const Eigen::VectorXd>(gradient, NumParameters()).allFinite();
  }

 private:
  const DesignScore& score_;
  const LimitPenalty& penalty_;
  double rho_;
};

struct Optimised {
  FlatMatrix free;
  int iterations = 0;
  bool time_limited = false;
};

Optimised Optimise(const DesignScore& score, const LimitPenalty& penalty, FlatMatrix free,
                   const DesignOptions& options) {
  Optimised result{std::move(free), 0, false};
  const auto start = Clock::now();
  const double rounds[] = {1e2, 1e3, 1e4};
  for (const double rho : rounds) {
    const ceres::GradientProblem problem(new PenalisedScore(score, penalty, rho));
    ceres::GradientProblemSolver::Options solver;
    solver.line_search_direction_type = ceres::LBFGS;
    solver.max_num_iterations = options.iterations;
    solver.function_tolerance = 1e-5;
    solver.max_solver_time_in_seconds =
        std::max(0.0, (options.time_limit - SecondsSince(start)) / (rho == rounds[2] ? 1 : 2));
    solver.logging_type = ceres::SILENT;
    ceres::GradientProblemSolver::Summary summary;
    ceres::Solve(solver, problem, result.free.data(), &summary);
    result.iterations += static_cast<int>(summary.iterations.size());
    result.time_limited |= summary.total_time_in_seconds > solver.max_solver_time_in_seconds;
  }
  return result;
}

// A random Lissajous figure as the control points of a start. Figures are often better than random
// flights, and the spline's ends make them start and end at rest.
FlatMatrix FigureControl(const RotorVehicle& vehicle, const SplineShape& shape,
                         const FlightLimits& limits, Random* random) {
  const Lissajous figure = RandomFigure(0.5 * limits.travel, 2.0, random);
  const double spacing = shape.duration / shape.pieces;
  FlatMatrix free(kFlatOutputs, shape.num_free());
  for (Eigen::Index j = 0; j < free.cols(); ++j) {
    free.col(j) = (2.0 * M_PI * static_cast<double>(j) * spacing * figure.frequency + figure.phase)
                      .array()
                      .sin()
                      .matrix()
                      .cwiseProduct(figure.amplitude);
  }
  return FilledToLimits(vehicle, shape, limits, free);
}

}  // namespace

double FlightScore(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                   const PiecewisePolynomial& path, const DesignTarget& target) {
  E2logOptions options;
  options.order = 4;
  options.segment = target.segment;
  const RotorFlight flight(vehicle, path);
  const Eigen::MatrixXd gramian = E2log(system, flight, target.weights, options);
  return ScoreStates(gramian, target.interest, target.asked, target.scale).sigma_min;
}

DesignResult DesignFlight(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                          const DesignTarget& target, const DesignOptions& options) {
  const auto started = Clock::now();
  const SplineShape& shape = options.shape;
  const int count = std::max(options.candidates, options.starts);
  std::vector<FlatMatrix> candidates(count);
  std::vector<double> scores(count);
  ParallelFor(count, options.threads, [&](int i) {
    Random random(options.seed + i, "design");
    const bool drawn = options.random_only || i % 2 == 0;
    candidates[i] =
        (drawn ? RandomFeasibleControl : FigureControl)(vehicle, shape, options.limits, &random);
    scores[i] = FlightScore(system, vehicle, SplinePath(shape, candidates[i]), target);
  });
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return scores[a] > scores[b]; });

  const DesignScore score(system, vehicle.parameters, shape, target, 1);
  const LimitPenalty penalty(MakeFlatVehicle(vehicle.model, vehicle.parameters), shape,
                             options.limits, kPenaltyStep, kMargin);
  std::vector<DesignResult> results(options.starts,
                                    {SplinePath(shape, candidates[0]), {}, 0, 0, 0, false, 0, {}});
  ParallelFor(options.starts, options.threads, [&](int i) {
    const Optimised optimised = Optimise(score, penalty, candidates[order[i]], options);
    DesignResult& result = results[i];
    result.path = ScaledToLimits(vehicle, SplinePath(shape, optimised.free), options.limits,
                                 options.check_step, 1.0);
    result.score = FlightScore(system, vehicle, result.path, target);
    result.start_score = scores[order[i]];
    result.iterations = optimised.iterations;
    result.time_limited = optimised.time_limited;
  });
  DesignResult best = *std::max_element(results.begin(), results.end(),
                                        [](auto& a, auto& b) { return a.score < b.score; });
  best.start_results.reserve(results.size());
  for (const DesignResult& result : results) best.start_results.push_back(result.score);
  best.use = CheckLimits(RotorFlight(vehicle, best.path), options.limits, options.check_step);
  best.seconds = SecondsSince(started);
  return best;
}

}  // namespace trueline
