// What part of a modelled moment turns a vehicle whose controller cancels slow disturbances.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "problems/prediction/wrench_experiment.h"

namespace trueline {
namespace {

constexpr double kStep = 0.0025;  // s

Eigen::VectorXd Times(int count) {
  return Eigen::VectorXd::LinSpaced(count, 0.0, kStep * (count - 1));
}

LevelMoments Sine(const Eigen::VectorXd& t, double frequency) {
  LevelMoments moment(2, t.size());
  moment << (2.0 * M_PI * frequency * t.array()).sin().matrix().transpose(),
      (2.0 * M_PI * frequency * t.array()).cos().matrix().transpose();
  return moment;
}

double Rms(const LevelMoments& moment) {
  return std::sqrt(moment.rightCols(moment.cols() / 2).squaredNorm() /
                   static_cast<double>(moment.cols()));
}

TEST(MomentWashout, PassesTheGainOfItsFilters) {
  const Eigen::VectorXd t = Times(8000);
  const MomentWashout washout{0.1, 0.01};
  for (const double frequency : {0.3, 1.6, 6.0}) {
    const double w = 2.0 * M_PI * frequency;
    const double high = std::pow(w * 0.1, 2) / (1.0 + std::pow(w * 0.1, 2));
    const double gain = high / std::sqrt(1.0 + std::pow(w * 0.01, 2));
    const LevelMoments sine = Sine(t, frequency);
    EXPECT_NEAR(Rms(washout.Of(sine, t)) / Rms(sine), gain, 0.03 * gain + 1e-3) << frequency;
  }
}

TEST(MomentWashout, AConstantTurnsNothing) {
  const Eigen::VectorXd t = Times(400);
  EXPECT_EQ(MomentWashout().Of(LevelMoments::Constant(2, 400, 0.3), t).norm(), 0.0);
}

// The slow part is cancelled by disturbances, the fast one turns the vehicle late; noise beside.
TEST(MomentWashout, ComesBackFromAFlight) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const MomentWashout truth{0.15, 0.02};
  MomentRecord flight{Times(20000), {}, LevelMoments(2, 20000)};
  for (Eigen::Index i = 0; i < flight.modelled.cols(); ++i) {
    for (int axis = 0; axis < 2; ++axis) {
      const double before = i > 0 ? flight.modelled(axis, i - 1) : 0.0;
      flight.modelled(axis, i) = 0.99 * before + normal(random);
    }
  }
  flight.measured = 0.7 * truth.Of(flight.modelled, flight.t);
  for (double& value : flight.measured.reshaped()) value += 0.3 * normal(random);
  const MomentWashout found = FitMomentWashout({flight});
  EXPECT_NEAR(found.washout, truth.washout, 0.1 * truth.washout);
  EXPECT_NEAR(found.lag, truth.lag, 0.1 * truth.lag);
  EXPECT_NEAR(ShareOf(flight.measured, found.Of(flight.modelled, flight.t)), 0.7, 0.03);
}

}  // namespace
}  // namespace trueline
