// Time of one prediction step of the Kalman filter, and the factor over real time at 512 Hz; of the
// covariance alone, beside full products.
#include <benchmark/benchmark.h>

#include "problems/ekf/ekf.h"

namespace trueline {
namespace {

constexpr double kGravity = 9.81, kRate = 512.0;

NavState Flying() {
  NavState x;
  x.motion.v = {3.0, 0.4, -0.2};
  x.motion.q_E_I = QuaternionFromEuler<double>({0.2, -0.3, 0.8});
  return x;
}

void Predict(benchmark::State& state, AttitudeForm form) {
  EkfOptions options;
  options.attitude = form;
  Ekf filter(options, kGravity);
  const NavState x = Flying();
  filter.Start(x, filter.StartCovariance(x));
  const ImuInput input{{0.3, -0.2, -9.9}, {0.1, -0.2, 0.3}};
  int step = 0;
  for (auto _ : state) {
    if (++step % 4096 == 0) filter.Start(x, filter.StartCovariance(x));
    filter.Predict(input, 1.0 / kRate);
  }
  state.counters["times_real_time_at_512Hz"] = benchmark::Counter(
      static_cast<double>(state.iterations()) / kRate, benchmark::Counter::kIsRate);
}

void Covariance(benchmark::State& state, bool dense) {
  Transition F;
  Advance(AttitudeForm::kErrorState, Flying(), {{0.3, -0.2, -9.9}, {0.1, -0.2, 0.3}}, kGravity,
          1.0 / kRate, &F);
  const Matrix15d P = Matrix15d::Identity();
  for (auto _ : state) {
    benchmark::DoNotOptimize(dense ? Matrix15d(F.Dense() * P * F.Dense().transpose())
                                   : Propagate(F, P));
  }
}

BENCHMARK_CAPTURE(Predict, error_state_sparse, AttitudeForm::kErrorState);
BENCHMARK_CAPTURE(Predict, euler_sparse, AttitudeForm::kEuler);
BENCHMARK_CAPTURE(Covariance, sparse, false)->Name("Propagate/sparse");
BENCHMARK_CAPTURE(Covariance, dense, true)->Name("Propagate/dense");

}  // namespace
}  // namespace trueline
