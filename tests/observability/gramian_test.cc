// Gramians against a closed form, against each other, and against finite differences.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "problems/common/error.h"
#include "problems/observability/e2log.h"
#include "problems/observability/lie_derivatives.h"
#include "problems/observability/variational_gramian.h"
#include "tests/observability/empirical_gramian.h"
#include "tests/observability/test_vehicle.h"

namespace trueline {
namespace {

// Undamped oscillator x'' = -x with x measured: K = (cos t, sin t).
struct Oscillator {
  static constexpr int kStates = 2, kMoving = 2, kErrors = 2;
  int num_outputs() const { return 1; }
  std::vector<StateInfo> errors() const { return std::vector<StateInfo>(2); }
  template <class T>
  void Derivative(const T* x, const T*, T* dx) const {
    dx[0] = x[1];
    dx[1] = -x[0];
  }
  template <class T>
  void Output(const T* x, const T*, T* y) const {
    y[0] = x[0];
  }
  template <class C>
  void Seed(const C* x, ceres::Jet<C, 2>* out) const {
    for (int i = 0; i < 2; ++i) out[i] = ceres::Jet<C, 2>(x[i], i);
  }
  template <class C>
  void Error(const C*, const C* dx, C* error) const {
    error[0] = dx[0];
    error[1] = dx[1];
  }
};

std::vector<double> Perturbed(const Oscillator&, std::vector<double> x, int error, double by) {
  x[error] += by;
  return x;
}

Eigen::Matrix2d OscillatorGramian(double T) {
  const double c = T / 2 + std::sin(2 * T) / 4, s = T / 2 - std::sin(2 * T) / 4;
  const double cross = std::sin(T) * std::sin(T) / 2;
  return (Eigen::Matrix2d() << c, cross, cross, s).finished();
}

NominalFlight OscillatorFlight(double T) {
  return {0.0, T, [](double t) { return NominalPoint{{std::cos(t), -std::sin(t)}, {}}; }};
}

TEST(Gramian, AllThreeGiveTheOscillatorsClosedForm) {
  const double T = 3.0;
  const Eigen::Matrix2d want = OscillatorGramian(T);
  EXPECT_LT((VariationalGramian(Oscillator{}, OscillatorFlight(T), {1.0}, 0.01) - want).norm(),
            1e-8);
  EXPECT_LT((EmpiricalGramian(Oscillator{}, OscillatorFlight(T), {1.0}, 0.01) - want).norm(), 1e-8);
  const auto local =
      ExpandSensitivity<12, double>(Oscillator{}, std::vector<double>{1.0, 0.0}, {}, 1.0);
  EXPECT_LT((LocalGramian<2, 12>(local, {1.0}, 1.0) - OscillatorGramian(1.0)).norm(), 1e-8);
  const Eigen::Matrix2d turn =
      (Eigen::Matrix2d() << std::cos(1.0), std::sin(1.0), -std::sin(1.0), std::cos(1.0)).finished();
  EXPECT_LT((local.transition - turn).norm(), 1e-8);
}

TEST(Gramian, GaussRuleIntegratesPolynomialsExactly) {
  for (const Quadrature* rule :
       {&GaussLegendre<1>(), &GaussLegendre<2>(), &GaussLegendre<5>(), &GaussLegendre<7>()}) {
    const std::size_t n = rule->nodes.size();
    for (std::size_t degree = 0; degree < 2 * n; ++degree) {
      double sum = 0.0;
      for (std::size_t i = 0; i < n; ++i)
        sum += rule->weights[i] * std::pow(rule->nodes[i], degree);
      EXPECT_NEAR(sum, 1.0 / (degree + 1), 1e-14);
    }
  }
}

class RotorGramian : public ::testing::Test {
 protected:
  RotorGramian() {
    std::srand(1);
    FlatMatrix control = 0.2 * FlatMatrix::Random(kFlatOutputs, 11);
    flight_ = std::make_unique<RotorFlight>(RotorVehicle{TestQuadrotor(), TestNominal()},
                                            PiecewisePolynomial::FromSpline(control, 7, 2.0));
  }
  // Largest difference, each state scaled to unit information.
  static double Difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    const Eigen::VectorXd scale = b.diagonal().unaryExpr(
        [](double value) { return value > 0.0 ? 1.0 / std::sqrt(value) : 1.0; });
    return (scale.asDiagonal() * (a - b) * scale.asDiagonal()).cwiseAbs().maxCoeff();
  }
  double E2logError(int order, double segment) const {
    E2logOptions options;
    options.order = order;
    options.segment = segment;
    return Difference(E2log(system_, *flight_, weights_, options), reference_);
  }

  RotorDrivenSystem system_{TestQuadrotor(), OnlySensors(true, false, true)};
  std::vector<double> weights_ = system_.OutputWeights();
  std::unique_ptr<RotorFlight> flight_;
  Eigen::MatrixXd reference_ = Eigen::MatrixXd();

  void SetUp() override {
    reference_ = VariationalGramian(system_, flight_->Nominal(), weights_, 0.002);
  }
};

TEST_F(RotorGramian, VariationalConvergesWithTheFourthPowerOfTheStep) {
  const auto error = [&](double h) {
    return Difference(VariationalGramian(system_, flight_->Nominal(), weights_, h), reference_);
  };
  EXPECT_LT(error(0.01), 1e-5);
  EXPECT_GT(std::log2(error(0.04) / error(0.01)), 2 * 3.5);
}

TEST_F(RotorGramian, E2logConvergesWithOrderAndSegment) {
  EXPECT_LT(E2logError(6, 0.025), 1e-6);
  EXPECT_LT(E2logError(4, 0.05), 1e-3);
  for (const int order : {2, 4}) {  // one power of the segment for each order, at least
    EXPECT_GT(std::log2(E2logError(order, 0.05) / E2logError(order, 0.025)), order - 0.5);
  }
  EXPECT_GT(E2logError(2, 0.05), E2logError(3, 0.05));
  EXPECT_GT(E2logError(3, 0.05), E2logError(4, 0.05));
}

TEST_F(RotorGramian, FiniteDifferencesAgreeWithTheExactOne) {
  const Eigen::MatrixXd empirical =
      EmpiricalGramian(system_, flight_->Nominal(), weights_, 0.005, 1e-4);
  EXPECT_LT(Difference(empirical, reference_), 1e-4);
}

TEST_F(RotorGramian, ThreadsDoNotChangeTheResult) {
  E2logOptions one, two;
  two.threads = 2;
  EXPECT_EQ(E2log(system_, *flight_, weights_, one), E2log(system_, *flight_, weights_, two));
}

TEST_F(RotorGramian, OrderOutOfRangeIsRefused) {
  E2logOptions options;
  options.order = 9;
  EXPECT_THROW(E2log(system_, *flight_, weights_, options), InputError);
}

}  // namespace
}  // namespace trueline
