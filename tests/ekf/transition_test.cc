// Transition, covariance and noise of one step against references that share no code with them.
#include <gtest/gtest.h>

#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

#include "cost_functions/models/rotation.h"
#include "problems/common/random.h"
#include "problems/ekf/ekf.h"

namespace trueline {
namespace {

Eigen::Vector3d WrappedDifference(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return (to - from).unaryExpr([](double angle) { return std::remainder(angle, 2.0 * M_PI); });
}

// Moved(form, from, Difference(form, from, to)) == to.
Vector15d Difference(AttitudeForm form, const NavState& from, const NavState& to) {
  Vector15d error;
  error << to.motion.p - from.motion.p, to.motion.v - from.motion.v, Eigen::Vector3d::Zero(),
      to.bias.accel - from.bias.accel, to.bias.gyro - from.bias.gyro;
  if (form == AttitudeForm::kEuler) {
    error.segment<3>(6) = WrappedDifference(EulerFromQuaternion(from.motion.q_E_I),
                                            EulerFromQuaternion(to.motion.q_E_I));
  } else {
    const Eigen::AngleAxisd turn(from.motion.q_E_I.conjugate() * to.motion.q_E_I);
    error.segment<3>(6) = std::remainder(turn.angle(), 2.0 * M_PI) * turn.axis();
  }
  return error;
}

constexpr double kStandardGravity = 9.81;
const ImuInput kImu{{0.7, -1.2, -10.3}, {0.9, -1.4, 2.1}};

NavState SomeState() {
  NavState x;
  x.motion.p = {1.0, -2.0, -1.5};
  x.motion.v = {3.0, 0.4, -0.2};
  x.motion.q_E_I = QuaternionFromEuler<double>({0.3, -0.4, 1.9});
  x.bias = {{0.1, -0.2, 0.3}, {0.02, -0.01, 0.03}};
  return x;
}

Matrix15d SomeCovariance() {
  srand(7);
  const Matrix15d A = Matrix15d::Random();
  return A * A.transpose() + 0.1 * Matrix15d::Identity();
}

class StepTest : public testing::TestWithParam<AttitudeForm> {};

TEST_P(StepTest, TransitionAgreesWithCentralDifferences) {
  const AttitudeForm form = GetParam();
  const NavState x = SomeState();
  Transition F;
  const NavState next = Advance(form, x, kImu, kStandardGravity, 0.01, &F);
  Matrix15d numeric;
  for (int i = 0; i < kNavSize; ++i) {
    const double h = 1e-6;
    Transition unused;
    const Vector15d error = h * Vector15d::Unit(i);
    const NavState plus =
        Advance(form, Moved(form, x, error), kImu, kStandardGravity, 0.01, &unused);
    const NavState minus =
        Advance(form, Moved(form, x, -error), kImu, kStandardGravity, 0.01, &unused);
    numeric.col(i) = (Difference(form, next, plus) - Difference(form, next, minus)) / (2.0 * h);
  }
  EXPECT_LT((F.Dense() - numeric).cwiseAbs().maxCoeff(), 1e-8);
}

TEST_P(StepTest, CovarianceAgreesWithFullProducts) {
  Transition F;
  Advance(GetParam(), SomeState(), kImu, kStandardGravity, 0.01, &F);
  const Matrix15d P = SomeCovariance();
  const Matrix15d sparse = Propagate(F, P), dense = F.Dense() * P * F.Dense().transpose();
  EXPECT_LT((sparse - dense).cwiseAbs().maxCoeff(), 1e-12 * dense.cwiseAbs().maxCoeff());
}

// Van Loan's integral of the continuous noise over one step, with A from two short transitions.
TEST_P(StepTest, NoiseAgreesWithVanLoan) {
  const AttitudeForm form = GetParam();
  const double dt = 0.002;
  const ImuNoise noise{0.05, 0.003, 0.2, 0.04};
  Transition tiny;
  Advance(form, SomeState(), kImu, kStandardGravity, 1e-6, &tiny);
  const Matrix15d A = (tiny.Dense() - Matrix15d::Identity()) / 1e-6;
  Matrix15d spectral = Matrix15d::Zero();
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  spectral.block<3, 3>(3, 3) = I * noise.accel * noise.accel;
  const Eigen::Matrix3d N = A.block<3, 3>(6, 12);
  spectral.block<3, 3>(6, 6) = N * N.transpose() * noise.gyro * noise.gyro;
  spectral.block<3, 3>(9, 9) = I * noise.accel_walk * noise.accel_walk;
  spectral.block<3, 3>(12, 12) = I * noise.gyro_walk * noise.gyro_walk;
  Eigen::MatrixXd pair = Eigen::MatrixXd::Zero(30, 30);
  pair.topLeftCorner<15, 15>() = -A * dt;
  pair.topRightCorner<15, 15>() = spectral * dt;
  pair.bottomRightCorner<15, 15>() = A.transpose() * dt;
  const Eigen::MatrixXd exponential = pair.exp();
  const Eigen::MatrixXd expected =
      exponential.bottomRightCorner<15, 15>().transpose() * exponential.topRightCorner<15, 15>();
  Transition F;
  Advance(form, SomeState(), kImu, kStandardGravity, dt, &F);
  const Matrix15d Q = StepNoise(F, noise);
  // Every block is held to 1 % of what its two diagonals allow at most.
  const Vector15d sigma = expected.diagonal().cwiseSqrt();
  const Matrix15d scaled = (Q - expected).cwiseQuotient(sigma * sigma.transpose());
  EXPECT_LT(scaled.cwiseAbs().maxCoeff(), 0.01);
}

INSTANTIATE_TEST_SUITE_P(Forms, StepTest,
                         testing::Values(AttitudeForm::kEuler, AttitudeForm::kErrorState));

TEST(NavStateTest, DifferenceUndoesMoved) {
  Vector15d error;
  for (int i = 0; i < kNavSize; ++i) error[i] = 0.05 * (i - 7);
  for (const AttitudeForm form : {AttitudeForm::kEuler, AttitudeForm::kErrorState}) {
    const NavState x = SomeState();
    EXPECT_LT((Difference(form, x, Moved(form, x, error)) - error).norm(), 1e-12);
  }
}

// A tilt of one sigma in E is the same rotation in both forms of the attitude error.
TEST(NavStateTest, StartCovarianceIsTheSameRotationInBothForms) {
  const NavState x = SomeState();
  const Eigen::Vector3d turn_E(1e-6, -2e-6, 3e-6);
  for (const AttitudeForm form : {AttitudeForm::kEuler, AttitudeForm::kErrorState}) {
    Vector15d error = Vector15d::Zero();
    error.segment<3>(6) = AttitudeErrorFromEarth(form, x) * turn_E;
    const Eigen::Quaterniond q = Moved(form, x, error).motion.q_E_I;
    const Eigen::Quaterniond turned = q * x.motion.q_E_I.conjugate();
    EXPECT_LT((2.0 * turned.vec() - turn_E).norm(), 1e-10);
  }
}

TEST(EkfTest, GateRefusesAnOutlierAndGivesInAfterEnoughOfThem) {
  EkfOptions options;
  options.max_refusals = 3;
  Ekf filter(options, kStandardGravity);
  NavState x;
  filter.Start(x, Matrix15d::Identity() * 0.01);
  const Eigen::Vector3d far(5.0, 0.0, 0.0);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(filter.Update(far, 0.1));
  EXPECT_EQ(filter.state().motion.p.norm(), 0.0);
  EXPECT_TRUE(filter.Update(far, 0.1));
  EXPECT_GT(filter.state().motion.p.x(), 1.0);
}

// The covariance after a fix by the information form, which Joseph's must equal.
TEST(EkfTest, UpdateAgreesWithInformationForm) {
  EkfOptions options;
  options.gating = EkfGating::kNone;
  options.attitude = AttitudeForm::kEuler;
  Ekf filter(options, kStandardGravity);
  const Matrix15d P = SomeCovariance();
  filter.Start(SomeState(), P);
  filter.Update(SomeState().motion.p + Eigen::Vector3d(0.1, 0.2, -0.1), 0.3);
  Matrix15d information = P.inverse();
  information.topLeftCorner<3, 3>() += Eigen::Matrix3d::Identity() / 0.09;
  EXPECT_LT((filter.cov() - information.inverse()).norm(), 1e-9);
}

// --- The filter's covariance against the empirical one in a linear Gaussian case: truth is drawn
// from the filter's own model with small errors, over many seeds.

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
