// Cost of VGD against one bare integration pass over the same window (gamma 3, 512 Hz, the paper's
// hippodrome with its following arc). Run: build/tests/vgd_bench; divide by BarePass.
#include <benchmark/benchmark.h>

#include "problems/simulation/config.h"
#include "problems/simulation/simulate.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd.h"
#include "problems/vgd/window_problem.h"
#include "tests/models/midpoint_step.h"

namespace trueline {
namespace {

constexpr int kTau = 10;

const FlightLog& Log() {
  static const FlightLog log = [] {
    const YamlMap map =
        YamlMap::FromFile(TRUELINE_BENCH_SOURCE_DIR "/config/simulate/hippodrome.yaml");
    SimulationConfig config = ReadSimulationConfig(map);
    config.duration = 50.0;
    return Simulate(config, 1);
  }();
  return log;
}

VgdOptions Options(bool rigid) {
  VgdOptions options;
  options.drag_measurement.enabled = !rigid;
  if (rigid) options.process = ProcessNoise();
  return options;
}

const FlightData& Flight() {
  static const VgdOptions options = Options(false);
  static const FlightData flight(Log(), options.drive, options.passes, options.drag_measurement);
  return flight;
}

WindowData Data(const VgdOptions& options) {
  const int first = Flight().FirstPassOf(kTau, options.gamma, options.min_window_fixes);
  return CutWindow(Flight(), options, first, kTau, true);
}

void BarePass(benchmark::State& state) {
  const WindowData data = Data(Options(true));
  ImuDrivenParameters<double> parameters;
  parameters.K_x = parameters.K_y = -0.5;
  const ImuDrivenModel<double> model(parameters, Flight().track.gravity());
  for (auto _ : state) {
    MotionState<double> x;
    Flight().track.ForEachStep(data.begin, data.end, [&](const Drive& drive, double dt) {
      MidpointStep(model, drive, dt, &x);
    });
    benchmark::DoNotOptimize(x);
  }
}
BENCHMARK(BarePass)->Unit(benchmark::kMicrosecond);

void PrepareWindow(benchmark::State& state) {
  const VgdOptions options = Options(state.range(0) == 1);
  const WindowData data = Data(options);
  for (auto _ : state) {
    WindowProblem problem(Flight().track, data, options);
    benchmark::DoNotOptimize(problem.segments().size());
  }
}
BENCHMARK(PrepareWindow)->ArgName("rigid")->Arg(1)->Arg(0)->Unit(benchmark::kMicrosecond);

void Evaluate(benchmark::State& state) {
  const VgdOptions options = Options(state.range(0) == 1);
  const WindowData data = Data(options);
  WindowProblem problem(Flight().track, data, options);
  const bool derivatives = state.range(1) == 1;
  const Eigen::Matrix<double, kThetaSize, 1> theta = Eigen::Matrix<double, kThetaSize, 1>::Zero();
  const Eigen::Vector3d drift = Eigen::Vector3d::Zero();
  const Eigen::Matrix<double, kStateSize, 1> x = Eigen::Matrix<double, kStateSize, 1>::Zero();
  for (auto _ : state) {
    for (const auto& segment : problem.segments()) {
      segment->Evaluate(theta.data(), drift.data(), x.data(), derivatives);
    }
  }
}
BENCHMARK(Evaluate)
    ->ArgNames({"rigid", "derivatives"})
    ->Args({1, 0})
    ->Args({1, 1})
    ->Args({0, 0})
    ->Args({0, 1})
    ->Unit(benchmark::kMicrosecond);

// The whole of a window: preparation, solve, covariance, statuses, prediction.
void FullSolve(benchmark::State& state) {
  const VgdOptions options = Options(state.range(0) == 1);
  const Theta start = PriorMeans(options);
  int iterations = 0;
  for (auto _ : state) iterations = SolveWindow(Flight(), options, kTau, start).iterations;
  state.counters["iterations"] = iterations;
}
BENCHMARK(FullSolve)->ArgName("rigid")->Arg(1)->Arg(0)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace trueline
