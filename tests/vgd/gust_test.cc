// Gusts as unknowns: effect on the path, derivatives, and gain.
#include <gtest/gtest.h>

#include "cost_functions/models/process_noise.h"
#include "problems/calibration/calibration.h"
#include "problems/vgd/drag_errors.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/window_problem.h"
#include "tests/common/bands.h"
#include "tests/vgd/flights.h"

namespace trueline::testing_vgd {
namespace {

// Of the part across a thrust axis that leans more and more, integrated in small steps.
TEST(Gust, MovesTheStateAsItsTwiceIntegralAcrossTheThrust) {
  const GustPair gusts(0.3, -0.2, 0.1, 0.4);
  const double h = 0.5, t_end = 0.37, dt = 1e-5;
  const auto thrust_axis = [](double t) {
    return Eigen::Vector3d(std::sin(t), 0.3, 1.0).normalized();
  };
  Eigen::Matrix<double, 6, 1> x = Eigen::Matrix<double, 6, 1>::Zero();
  for (double t = 0.5 * dt; t < t_end; t += dt) {
    const double u = t / h;
    Eigen::Vector3d a = Eigen::Vector3d::Zero();
    a.head<2>() = (1.0 - u) * gusts.head<2>() + u * gusts.tail<2>();
    a -= a.dot(thrust_axis(t)) * thrust_axis(t);
    x.head<3>() += dt * (x.tail<3>() + 0.5 * dt * a);
    x.tail<3>() += dt * a;
  }
  StateByGusts state(h);
  for (int i = 1; i <= 37; ++i) state.Advance(0.01 * i, thrust_axis(0.01 * (i - 0.5)));
  EXPECT_LT((state.d() * gusts - x).norm(), 1e-5);
  EXPECT_GT(std::abs(x[5]), 1e-3);  // a gust that the vehicle leans into moves it vertically
}

// All residuals of a window against all of its unknowns, by central differences: gusts through
// fixes, forces and steps, linked segments and the last one.
TEST(Gust, WindowsDerivativesAreThoseOfItsResiduals) {
  VgdOptions options;
  options.gamma = 1;
  options.loss = FixLoss::kNone;
  SimulationConfig config = ExactHippodrome(6.0);
  const Flight flight(config, 2, options);
  const WindowData data = CutWindow(flight.data, options, 0, 1, true);
  WindowProblem window(flight.data.track, data, options);
  window.SetStart(PriorMeans(options), RoughPath(flight.data.log.fixes, data.passes));
  ceres::Problem& problem = window.problem();
  ceres::Problem::EvaluateOptions all;
  all.apply_loss_function = false;
  problem.GetParameterBlocks(&all.parameter_blocks);
  std::vector<double> residuals;
  ceres::CRSMatrix jacobian;
  problem.Evaluate(all, nullptr, &residuals, nullptr, &jacobian);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(jacobian.num_rows, jacobian.num_cols);
  for (int row = 0; row < jacobian.num_rows; ++row) {
    for (int k = jacobian.rows[row]; k < jacobian.rows[row + 1]; ++k) {
      J(row, jacobian.cols[k]) = jacobian.values[k];
    }
  }
  const auto at = [&] {
    std::vector<double> r;
    problem.Evaluate(all, nullptr, &r, nullptr, nullptr);
    return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(r.data(), long(r.size())));
  };
  int col = 0, gust_blocks = 0;
  for (double* block : all.parameter_blocks) {
    const int size = problem.ParameterBlockSize(block);
    gust_blocks += size == kGustSize;
    for (int i = 0; i < size; ++i, ++col) {
      const double kept = block[i], step = 1e-4;
      block[i] = kept + step;
      const Eigen::VectorXd up = at();
      block[i] = kept - step;
      const Eigen::VectorXd down = at();
      block[i] = kept;
      const Eigen::VectorXd numeric = (up - down) / (2.0 * step);
      EXPECT_LT((J.col(col) - numeric).norm(), 1e-5 * (1.0 + numeric.norm())) << size << " " << i;
    }
  }
  EXPECT_GE(gust_blocks, 3);
}

TEST(Gust, NeedsTheAccelerometerAndAProcess) {
  VgdOptions options;
  EXPECT_TRUE(options.UsesGusts());
  options.drag_measurement.enabled = false;
  EXPECT_FALSE(options.UsesGusts());
  EXPECT_FALSE(RigidOptions().UsesGusts());
}

// Share of arcs inside of their 95 % ellipses, and the mean error, in lasting gusts of 0.25 m/s^2.
struct Arcs {
  double error = 0.0, squares = 0.0;  // m; in sigmas, summed
  int count = 0, inside = 0;
};

Arcs FlyThroughGusts(const VgdOptions& options) {
  Arcs arcs;
  for (int seed = 1; seed <= 3; ++seed) {
    SimulationConfig config = ExactHippodrome(40.0);
    config.turbulence.sigma = {0.25, 0.25, 0.1};
    config.turbulence.memory = 0.8;
    const Flight flight(config, seed, options);
    const EstimatorRun run = RunVgd(flight.data, options);
    const ArcSummary summary = SummariseArcs(run);
    arcs.count += summary.error.count;
    arcs.inside += summary.inside_95;
    arcs.error += summary.error.mean * summary.error.count;
    arcs.squares += SquaredArcErrors(run);
  }
  arcs.error /= arcs.count;
  return arcs;
}

TEST(Gust, SlowAreNotTakenForDragOrCertainty) {
  VgdOptions without;
  without.process.gust = 0.0;
  const Arcs with_gusts = FlyThroughGusts(VgdOptions()), none = FlyThroughGusts(without);
  EXPECT_GT(with_gusts.count, 20);
  ExpectCoverage(with_gusts.inside, with_gusts.count, 0.95, "95 % ellipses");
  ExpectChiSquare(with_gusts.squares, 2.0 * with_gusts.count, "ends of arcs");
  EXPECT_GT(with_gusts.inside, none.inside);
  EXPECT_LT(with_gusts.error, none.error);
}

// A velocity that varies by less than its uncertainty gives no information on drag; with ten times
// its uncertainty it gives all.
TEST(DragErrors, FollowsHowWellTheVelocityIsKnown) {
  DragErrors drag_errors;
  for (int i = 0; i < 100; ++i) {
    const double sign = i % 2 == 0 ? 1.0 : -1.0;
    drag_errors.Add({1.0 + 0.5 * sign, 0.02 * sign}, {0.05 * 0.05, 0.04 * 0.04}, 0.0, 10);
  }
  EXPECT_NEAR(drag_errors.Spread().x(), 0.5, 1e-9);
  EXPECT_NEAR(drag_errors.Uncertainty().y(), 0.04, 1e-9);
  const double force_sigma = 0.2;
  // Sigma from the accelerometer alone: sigma / (spread sqrt(samples)).
  const Eigen::Vector2d alone =
      force_sigma * drag_errors.Spread().cwiseInverse() / std::sqrt(1000.0);
  const Eigen::Vector2d sigma = drag_errors.Sigma({-0.5, -0.5}, alone.cwiseAbs2(), force_sigma);
  EXPECT_NEAR(sigma.x(), 0.5 * 0.01, 1e-6);
  EXPECT_NEAR(sigma.y(), 0.5, 1e-6);
  // If most of the information comes from the motion, the added sigma is smaller.
  EXPECT_NEAR(drag_errors.Sigma({-0.5, -0.5}, 0.04 * alone.cwiseAbs2(), force_sigma).y(), 0.02,
              1e-6);
  DragErrors twice = drag_errors;
  twice.Add(drag_errors);
  EXPECT_NEAR(twice.Sigma({-0.5, -0.5}, 0.04 * alone.cwiseAbs2(), force_sigma).y(), 0.04, 1e-6);
}

// A velocity that gusts may have made tells no drag, however well it is known.
TEST(DragErrors, VelocityOfGustsIsUncommanded) {
  const double force_sigma = 0.2;
  DragErrors drag_errors;
  for (const double v : {-0.1, 0.1}) drag_errors.Add({v, 5.0 * v}, {1e-6, 1e-6}, 0.1, 500);
  EXPECT_TRUE(drag_errors.ShowsDrag()[0] && drag_errors.ShowsDrag()[1]);
  EXPECT_NEAR(drag_errors.Uncommanded().x(), std::hypot(1e-3, 0.1), 1e-9);
  const Eigen::Vector2d alone =
      force_sigma * drag_errors.Spread().cwiseInverse() / std::sqrt(1000.0);
  const Eigen::Vector2d sigma = drag_errors.Sigma({-0.5, -0.5}, alone.cwiseAbs2(), force_sigma);
  EXPECT_NEAR(sigma.x(), 0.5, 1e-3);
  EXPECT_NEAR(sigma.y(), 0.5 / 25.0, 1e-3);
}

TEST(DragErrors, WidensWhatIsCorrelatedWithDragAndNothingBeyondItsPrior) {
  VgdOptions options;
  Eigen::MatrixXd cov = 0.04 * Eigen::MatrixXd::Identity(11, 11);
  cov(1, 6) = cov(6, 1) = 0.02;
  DragErrors drag_errors;
  drag_errors.Add({0.0, 0.1}, {0.0, 0.01}, 0.0, 1000);
  drag_errors.Add({0.0, -0.1}, {0.0, 0.01}, 0.0, 1000);
  WidenDrag(drag_errors, options, 0.2, Eigen::VectorXd::Ones(11), &cov);
  EXPECT_NEAR(cov(0, 0), 0.04, 1e-12);
  EXPECT_NEAR(cov(1, 1), 0.29, 1e-9);  // 0.04 and all of a drag of 0.5
  EXPECT_NEAR(cov(6, 6), 0.04 + 0.25 * 0.25, 1e-9);
  EXPECT_NEAR(cov(5, 5), 0.04, 1e-12);
}

// Values of a fit whose variance of drag was widened: those of the same data with less weight.
TEST(DragErrors, AWidenedDragReturnsToItsPrior) {
  VgdOptions options;
  Eigen::MatrixXd cov = 0.04 * Eigen::MatrixXd::Identity(11, 11), wider = cov;
  cov(1, 6) = cov(6, 1) = 0.02;
  Eigen::VectorXd deviation = Eigen::VectorXd::Zero(11);
  deviation[0] = 0.3;
  deviation[1] = -0.96;  // the data alone: -1.0
  EXPECT_EQ(ReturnDrag(options, cov, wider, deviation), deviation);
  wider(1, 1) = 0.28;  // the data have three quarters of their weight
  const Eigen::VectorXd less = ReturnDrag(options, cov, wider, deviation);
  EXPECT_NEAR(less[1], -0.72, 1e-9);
  EXPECT_NEAR(less[6], 0.5 * 0.24, 1e-9);
  EXPECT_EQ(less[0], 0.3);
  wider(1, 1) = 1.0;
  EXPECT_NEAR(ReturnDrag(options, cov, wider, deviation)[1], 0.0, 1e-9);
  options.ranges = RangeUse::kBounds;
  EXPECT_EQ(ReturnDrag(options, cov, wider, deviation), deviation);
}

}  // namespace
}  // namespace trueline::testing_vgd
