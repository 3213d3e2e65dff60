// Cost of VGD against one bare integration pass over the same window (gamma 3, 512 Hz, the paper's
// hippodrome with its following arc), and against what a user would write with Ceres alone. Run:
// build/tests/vgd_bench; divide by BarePass.
#include <benchmark/benchmark.h>
#include <ceres/autodiff_cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include "problems/simulation/config.h"
#include "problems/simulation/simulate.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd.h"
#include "problems/vgd/window_estimate.h"
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
  options.drive.longest_hold = 0.0;  // the attitude as logged, as scripts/beside.py reads it
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
  WindowEstimate solved;
  for (auto _ : state) solved = SolveWindow(Flight(), options, kTau, start);
  state.counters["iterations"] = solved.iterations;
  state.counters["K_x"] = ThetaOf(solved)[InTheta("K_x")];
  state.counters["K_y"] = ThetaOf(solved)[InTheta("K_y")];
}
BENCHMARK(FullSolve)->ArgName("rigid")->Arg(1)->Arg(0)->Unit(benchmark::kMicrosecond);

// One AutoDiff residual a fix, which integrates the window from its start (eq. 28-29).
struct PlainFix {
  TimeNs begin;
  const Fix& fix;

  template <class T>
  bool operator()(const T* theta, const T* start, T* r) const {
    const DriveTrack& track = Flight().track;
    const ImuDrivenModel<T> model(ImuDrivenParameters<T>::FromArray(theta), track.gravity(),
                                  track.thrust_axis());
    MotionState<T> x{Vector3<T>(start[0], start[1], start[2]),
                     Vector3<T>(start[3], start[4], start[5])};
    track.ForEachStep(begin, fix.t,
                      [&](const Drive& drive, double dt) { MidpointStep(model, drive, dt, &x); });
    for (int i = 0; i < 3; ++i) r[i] = (x.p[i] - fix.p_E[i]) / fix.sigma;
    return true;
  }
};

struct PlainPrior {
  template <class T>
  bool operator()(const T* theta, T* r) const {
    const MotionPriors priors = DefaultPriors();
    for (int i = 0; i < kMotionSize; ++i) r[i] = (theta[i] - priors[i].mean) / priors[i].sigma;
    return true;
  }
};

// The rigid window as a plain problem: no covariance, statuses or prediction.
void PlainCeres(benchmark::State& state) {
  const VgdOptions options = Options(true);
  const WindowData data = Data(options);
  double theta[kMotionSize], start[6];
  ceres::Solver::Summary summary;
  for (auto _ : state) {
    for (int i = 0; i < kMotionSize; ++i) theta[i] = options.priors[i].mean;
    Eigen::Map<Eigen::Matrix<double, 6, 1>>(start) << data.fixes.front().p_E, 0.0, 0.0, 0.0;
    ceres::Problem problem;
    for (const Fix& fix : data.fixes) {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PlainFix, 3, kMotionSize, 6>(
                                   new PlainFix{data.begin, fix}),
                               new ceres::HuberLoss(options.loss_scale), theta, start);
    }
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PlainPrior, kMotionSize, kMotionSize>(new PlainPrior),
        nullptr, theta);
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_QR;
    solver.function_tolerance = options.tolerance;
    solver.max_num_iterations = options.max_iterations;
    solver.logging_type = ceres::SILENT;
    ceres::Solve(solver, &problem, &summary);
  }
  state.counters["iterations"] = static_cast<double>(summary.iterations.size());
  state.counters["K_x"] = theta[InTheta("K_x")];
  state.counters["K_y"] = theta[InTheta("K_y")];
}
BENCHMARK(PlainCeres)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace trueline
