// Gramians of a 20 s flight of the rotor-driven model with IMU and pose, on one core.
#include <benchmark/benchmark.h>

#include "problems/observability/design_score.h"
#include "problems/observability/e2log.h"
#include "problems/observability/observe.h"
#include "problems/observability/variational_gramian.h"
#include "tests/observability/empirical_gramian.h"
#include "tests/observability/test_vehicle.h"

namespace trueline {
namespace {

const RotorDrivenSystem& System() {
  static const RotorDrivenSystem system(TestQuadrotor(), OnlySensors(true, false, true));
  return system;
}

const RotorFlight& Flight() {
  static const RotorFlight flight = [] {
    std::srand(1);
    FlatMatrix control = 0.25 * FlatMatrix::Random(kFlatOutputs, 47);
    return RotorFlight({TestQuadrotor(), TestNominal()},
                       PiecewisePolynomial::FromSpline(control, 7, 20.0));
  }();
  return flight;
}

void E2logOf20s(benchmark::State& state) {
  E2logOptions options;
  options.order = static_cast<int>(state.range(0));
  options.segment = 1e-3 * static_cast<double>(state.range(1));
  for (auto unused : state) {
    benchmark::DoNotOptimize(E2log(System(), Flight(), System().OutputWeights(), options));
  }
}
BENCHMARK(E2logOf20s)
    ->ArgNames({"order", "segment_ms"})
    ->Args({2, 100})
    ->Args({3, 100})
    ->Args({4, 100})
    ->Args({4, 50})
    ->Args({6, 250})
    ->Unit(benchmark::kMillisecond);

void ExactGramianOf20s(benchmark::State& state) {
  const double step = 1e-3 * static_cast<double>(state.range(0));
  for (auto unused : state) {
    benchmark::DoNotOptimize(
        VariationalGramian(System(), Flight().Nominal(), System().OutputWeights(), step));
  }
}
BENCHMARK(ExactGramianOf20s)->ArgName("step_ms")->Arg(10)->Arg(20)->Unit(benchmark::kMillisecond);

void EmpiricalGramianOf20s(benchmark::State& state) {
  for (auto unused : state) {
    benchmark::DoNotOptimize(
        EmpiricalGramian(System(), Flight().Nominal(), System().OutputWeights(), 0.01));
  }
}
BENCHMARK(EmpiricalGramianOf20s)->Unit(benchmark::kMillisecond);

// One evaluation of the design's score and its gradient by 132 control points.
void DesignScoreAndGradientOf20s(benchmark::State& state) {
  DesignTarget target;
  for (const char* name : {"r_BP_x", "r_BP_y", "r_BP_z"}) {
    target.interest.push_back(FindState(System().errors(), name));
  }
  target.asked = System().PaperStates();
  target.scale = TypicalSizes(System().errors());
  target.weights = System().OutputWeights();
  const SplineShape shape;
  const DesignScore score(System(), TestNominal(), shape, target, 1);
  Random random(1);
  const FlatMatrix free = RandomControl(shape, 0.25, 0.5, &random);
  FlatMatrix gradient;
  for (auto unused : state) benchmark::DoNotOptimize(score.Evaluate(free, &gradient));
}
BENCHMARK(DesignScoreAndGradientOf20s)->Unit(benchmark::kMillisecond);

void ExactRankOf31States(benchmark::State& state) {
  for (auto unused : state) {
    benchmark::DoNotOptimize(
        RotorDrivenRank(System(), TestNominal(), System().PaperStates(), Motion::kVarying));
  }
}
BENCHMARK(ExactRankOf31States)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trueline
