// The filter's covariance against the empirical one in a linear Gaussian case: truth is drawn from
// the filter's own model with small errors, over many seeds.
#include <gtest/gtest.h>

#include <vector>

#include "problems/common/random.h"
#include "problems/ekf/ekf.h"
#include "tests/ekf/nav_difference.h"

namespace trueline {
namespace {

constexpr double kGravity = 9.81, kRate = 100.0, kFixSigma = 0.05;
constexpr int kSteps = 300, kStepsBetweenFixes = 10, kSeeds = 150;

EkfOptions SmallErrors(AttitudeForm form) {
  EkfOptions options;
  options.attitude = form;
  options.gating = EkfGating::kNone;
  options.noise = {0.02, 0.0005, 0.01, 0.0002};
  options.start = {0.1, 0.1, 0.003, 0.003, 0.05, 0.002};
  return options;
}

// Quantile of chi-square by Wilson and Hilferty; exact to 1e-3 for the hundreds of degrees here.
double ChiSquareQuantile(double freedom, double z) {
  const double h = 2.0 / (9.0 * freedom);
  return freedom * std::pow(1.0 - h + z * std::sqrt(h), 3.0);
}

ImuInput TrueInput(double t) {
  return {{1.5 * std::sin(1.3 * t), 0.8 * std::cos(0.9 * t), -kGravity + 0.7 * std::sin(2.0 * t)},
          {0.9 * std::sin(0.8 * t), 0.5 * std::cos(1.1 * t), 0.7}};
}

// Errors of the true IMU by its densities: white noise as a sample's mean over dt, random walks of
// biases.
struct NoisyImu {
  ImuNoise noise;
  Random random;

  ImuInput Read(const ImuInput& truth, double dt, ImuBias<double>* bias) {
    const double white = 1.0 / std::sqrt(dt), walk = std::sqrt(dt);
    const ImuInput read{truth.accel + bias->accel + noise.accel * white * random.NormalVector3(),
                        truth.gyro + bias->gyro + noise.gyro * white * random.NormalVector3()};
    bias->accel += noise.accel_walk * walk * random.NormalVector3();
    bias->gyro += noise.gyro_walk * walk * random.NormalVector3();
    return read;
  }
};

struct Consistency {
  double nees = 0.0, nis = 0.0;
  int nis_count = 0;
};

void FlyOnce(AttitudeForm form, std::uint64_t seed, Consistency* sums) {
  const EkfOptions options = SmallErrors(form);
  Random random(seed, "start");
  Ekf filter(options, kGravity);
  NavState guess;
  guess.motion.v = Eigen::Vector3d(2.0, 0.0, 0.0);
  guess.motion.q_E_I = QuaternionFromEuler<double>({0.2, -0.3, 0.8});
  const Matrix15d P = filter.StartCovariance(guess);
  filter.Start(guess, P);
  Vector15d draw;
  for (int i = 0; i < kNavSize; ++i) draw[i] = random.Normal();
  NavState truth = Moved(form, guess, Matrix15d(P.llt().matrixL()) * draw);
  NoisyImu imu{options.noise, Random(seed, "imu")};

  const double dt = 1.0 / kRate;
  for (int k = 0; k < kSteps; ++k) {
    const ImuInput input = TrueInput(k * dt);
    filter.Predict(imu.Read(input, dt, &truth.bias), dt);
    KinematicStep(input, ImuBias<double>(), kGravity, dt, &truth.motion);
    truth.motion.q_E_I.normalize();
    if (k % kStepsBetweenFixes != kStepsBetweenFixes - 1) continue;
    filter.Update(truth.motion.p + kFixSigma * random.NormalVector3(), kFixSigma);
    sums->nis += filter.last_nis();
    ++sums->nis_count;
  }
  const Vector15d error = Difference(form, filter.state(), truth);
  sums->nees += error.dot(filter.cov().llt().solve(error));
}

class FilterConsistency : public testing::TestWithParam<AttitudeForm> {};

TEST_P(FilterConsistency, NeesAndNisLieInTheir95PercentBands) {
  Consistency sums;
  for (int seed = 0; seed < kSeeds; ++seed) FlyOnce(GetParam(), seed, &sums);
  const double nees_freedom = kNavSize * kSeeds, nis_freedom = 3.0 * sums.nis_count;
  EXPECT_GT(sums.nees, ChiSquareQuantile(nees_freedom, -1.96));
  EXPECT_LT(sums.nees, ChiSquareQuantile(nees_freedom, 1.96));
  EXPECT_GT(sums.nis, ChiSquareQuantile(nis_freedom, -1.96));
  EXPECT_LT(sums.nis, ChiSquareQuantile(nis_freedom, 1.96));
  RecordProperty("nees_mean", std::to_string(sums.nees / kSeeds));
  RecordProperty("nis_mean", std::to_string(sums.nis / sums.nis_count));
  std::printf("mean NEES %.3f (15), mean NIS %.3f (3)\n", sums.nees / kSeeds,
              sums.nis / sums.nis_count);
}

INSTANTIATE_TEST_SUITE_P(Forms, FilterConsistency,
                         testing::Values(AttitudeForm::kEuler, AttitudeForm::kErrorState));

}  // namespace
}  // namespace trueline
