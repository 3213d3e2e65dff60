// Time of one prediction step of the Kalman filter, sparse against dense, and the factor over real
// time at 512 Hz.
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

void Predict(benchmark::State& state, AttitudeForm form, CovarianceForm covariance) {
  EkfOptions options;
  options.attitude = form;
  options.covariance = covariance;
  Ekf filter(options, kGravity);
  const NavState x = Flying();
  filter.Start(x, filter.StartCovariance(x));
  const ImuInput input{{0.3, -0.2, -9.9}, {0.1, -0.2, 0.3}};
  int step = 0;
  for (auto _ : state) {
    if (++step % 4096 == 0) filter.Start(x, filter.StartCovariance(x));
    filter.Predict(input, 1.0 / kRate);
  }
  state.counters["times_real_time_at_512Hz"] =
      benchmark::Counter(static_cast<double>(state.iterations()) / kRate,
                         benchmark::Counter::kIsRate);
}

void Propagate(benchmark::State& state, CovarianceForm covariance) {
  Transition F;
  Advance(AttitudeForm::kErrorState, Flying(), {{0.3, -0.2, -9.9}, {0.1, -0.2, 0.3}}, kGravity,
          1.0 / kRate, &F);
  const Matrix15d P = Matrix15d::Identity();
  for (auto _ : state) {
    benchmark::DoNotOptimize(covariance == CovarianceForm::kSparse ? PropagateSparse(F, P)
                                                                   : PropagateDense(F, P));
  }
}

BENCHMARK_CAPTURE(Predict, error_state_sparse, AttitudeForm::kErrorState, CovarianceForm::kSparse);
BENCHMARK_CAPTURE(Predict, error_state_dense, AttitudeForm::kErrorState, CovarianceForm::kDense);
BENCHMARK_CAPTURE(Predict, euler_sparse, AttitudeForm::kEuler, CovarianceForm::kSparse);
BENCHMARK_CAPTURE(Predict, euler_dense, AttitudeForm::kEuler, CovarianceForm::kDense);
BENCHMARK_CAPTURE(Propagate, sparse, CovarianceForm::kSparse);
BENCHMARK_CAPTURE(Propagate, dense, CovarianceForm::kDense);

}  // namespace
}  // namespace trueline
