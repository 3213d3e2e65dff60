#include "problems/rotor/rotor_batch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/common/error.h"
#include "problems/rotor/rotor_segment.h"
#include "problems/rotor/rotor_vehicle.h"
#include "tests/common/bands.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

struct Case {
  RotorSimulation sim{WuestVehicle()};
  RotorAeroModel model = EstimationModel(sim.vehicle);
  RotorTruth truth;
  RotorData data;
  RotorBatchOptions options;

  explicit Case(double duration, std::uint64_t seed = 11) {
    const FlightLog log = SimulateRotorFlight(sim, RandomPath(duration, 4), seed, &truth);
    data = MakeRotorData(log, 4, {});
    options.noise = sim.noise;
    options.prior = DrawnPrior(sim.vehicle, seed);
  }
  RotorNode TrueNode(int i) const {
    return {truth.states[std::lround(data.poses[i].t * sim.imu_rate)]};
  }
};

RotorNode Moved(const RotorNode& node, int error, double by) {
  return Plus(node, RotorNodeError(by * RotorNodeError::Unit(error)));
}

// Also at an arm of the IMU other than that of the weights.
TEST(RotorSegment, DerivativesAgreeWithDifferences) {
  const Case c(3.0);
  SegmentModel segment(c.model, c.data, c.sim.noise, CutSegments(c.data)[40]);
  RotorConstants elsewhere = c.truth.constants;
  elsewhere.segment<3>(FindRotorConstant("r_BI_x")) += Eigen::Vector3d(0.02, -0.03, 0.01);
  segment.SetWeight(segment.Follow(c.TrueNode(40), elsewhere));
  RotorNode start = Moved(c.TrueNode(40), 1, 0.05);
  start.drift << 3.0, -2.0, 1.0;
  const RotorNode next = c.TrueNode(41);
  RotorConstants constants = c.truth.constants;
  constants.segment<11>(FindRotorConstant("K_x")) << -0.3, -0.4, -0.2, 1e-5, -6.0, -5.0, -1.0, -4.0,
      3.0, 2e-5, 0.01;
  const SegmentResidual r = segment.Evaluate(start, next, constants, true);
  const double h = 1e-6;
  const auto difference = [&](const RotorNode& s, const RotorNode& n, const RotorConstants& k,
                              const RotorNode& s0, const RotorNode& n0, const RotorConstants& k0,
                              double step) -> Eigen::VectorXd {
    return (segment.Evaluate(s, n, k, false).error - segment.Evaluate(s0, n0, k0, false).error) /
           step;
  };
  for (int i = 0; i < kNodeErrors; ++i) {
    const Eigen::VectorXd d_start = difference(Moved(start, i, h), next, constants,
                                               Moved(start, i, -h), next, constants, 2 * h);
    EXPECT_LT((d_start - r.d_start.col(i)).norm(), 1e-6 * (1.0 + d_start.norm())) << i;
    const Eigen::VectorXd d_next = difference(start, Moved(next, i, h), constants, start,
                                              Moved(next, i, -h), constants, 2 * h);
    EXPECT_LT((d_next - r.d_next.col(i)).norm(), 1e-6 * (1.0 + d_next.norm())) << i;
  }
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    const double step = 1e-5 * std::max(1e-3, std::abs(constants[i]));
    RotorConstants up = constants, down = constants;
    up[i] += step, down[i] -= step;
    const Eigen::VectorXd d = difference(start, next, up, start, next, down, 2 * step);
    EXPECT_LT((d - r.d_constants.col(i)).norm(), 1e-4 * (1.0 + d.norm())) << i;
  }
}

// Drag that drives the vehicle on, by a factor of e^50 between two poses: a diagnosis may try such
// a model (found on a nano-drone's flight with late poses, where it ended the program).
TEST(RotorBatch, AModelThatRunsAwayHasAnInfiniteCost) {
  const Case c(3.0);
  const RotorBatchResult fit = RunRotorBatch(c.model, c.data, c.options);
  ASSERT_TRUE(std::isfinite(fit.cost));
  RotorBatchOptions away = c.options;
  away.prior.mean.segment<3>(FindRotorConstant("K_x")).setConstant(50.0 / 0.01);
  const RotorBatchResult none = RunRotorBatch(c.model, c.data, away, &fit);
  EXPECT_EQ(none.cost, std::numeric_limits<double>::infinity());
  EXPECT_EQ(none.mean, fit.mean);
  EXPECT_EQ(none.nodes, fit.nodes);
  EXPECT_THROW(RunRotorBatch(c.model, c.data, away), InputError);
}

// At the truth the whitened rows are white: the mean of their squares is 1, for disturbances and
// readings together, although each step's disturbance moves many rows.
TEST(RotorSegment, WhitenedErrorsAtTheTruthAreWhite) {
  const Case c(8.0);
  double sum = 0.0, neighbours = 0.0;
  int rows = 0, i = 0;
  for (RotorSegment& cut : CutSegments(c.data)) {
    SegmentModel segment(c.model, c.data, c.sim.noise, std::move(cut));
    segment.SetWeight(segment.Follow(c.TrueNode(i), c.truth.constants));
    SegmentResidual r = segment.Evaluate(c.TrueNode(i), c.TrueNode(i + 1), c.truth.constants, true);
    segment.Whiten(&r);
    sum += r.error.squaredNorm();
    neighbours += r.error.head(r.error.size() - 1).dot(r.error.tail(r.error.size() - 1));
    rows += static_cast<int>(r.error.size());
    ++i;
  }
  EXPECT_NEAR(sum / rows, 1.0, 4.0 * std::sqrt(2.0 / rows));
  EXPECT_NEAR(neighbours / rows, 0.0, 4.0 / std::sqrt(rows));
}

TEST(ConstantsChart, EveryPointIsABody) {
  RotorConstants constants = Case(2.0).truth.constants;
  EXPECT_LT((FromChart(ToChart(constants)) - constants).norm(), 1e-14);
  RotorConstants flat = constants;
  flat[3] = flat[1] + flat[2];
  EXPECT_TRUE(ToChart(flat).allFinite());
  EXPECT_LT((FromChart(ToChart(flat)) - flat).norm(), 1e-5 * flat[3]);
  RotorConstants chart = ToChart(constants);
  chart.head<4>() << -9.0, 2.0, -30.0, 1.0;
  EXPECT_GT(FromChart(chart)[0], 0.0);
  EXPECT_TRUE(IsPhysicalInertia(FromChart(chart).segment<3>(1)));
  const double h = 1e-6;
  const ConstantsJacobian jacobian = ChartJacobian(ToChart(constants));
  for (int i = 0; i < 4; ++i) {
    RotorConstants up = ToChart(constants), down = up;
    up[i] += h, down[i] -= h;
    const RotorConstants d = (FromChart(up) - FromChart(down)) / (2 * h);
    EXPECT_LT((d - jacobian.col(i)).norm(), 1e-8);
  }
}

TEST(ConstantsChart, StepsChangeAngularAccelerationEvenly) {
  const RotorConstants constants = Case(2.0).truth.constants, chart = ToChart(constants);
  const int yaw = FindRotorConstant("k_m");
  RotorConstants step = RotorConstants::Zero();
  step.segment<3>(kInertiaConstants) << 0.3, -0.4, 0.2;
  step[yaw] = -0.3 * constants[yaw];
  const double h = 1e-6;
  const RotorConstants slope = (FromChart(MovedInChart(chart, h * step)) - constants) / h;
  const RotorConstants expected = ChartJacobian(chart) * step;
  EXPECT_LT((slope - expected).norm(), 1e-4 * expected.norm());
  // Accelerations by a moment about x, y, z, and by the rotors' yaw moment.
  const auto accelerations = [&](double part) -> Eigen::Vector4d {
    const RotorConstants at = FromChart(MovedInChart(chart, part * step));
    const Eigen::Array3d inverse = at.segment<3>(kInertiaConstants).array().inverse();
    return {inverse[0], inverse[1], inverse[2], at[yaw] * inverse[2]};
  };
  const Eigen::Vector4d middle = 0.5 * (accelerations(0.0) + accelerations(1.0));
  EXPECT_LT((accelerations(0.5) - middle).norm(), 1e-9 * middle.norm());
  EXPECT_GT((accelerations(1.0) - accelerations(0.0)).norm(), 0.1 * middle.norm());
}

TEST(ConstantsChart, AStepBeyondAllBodiesIsTakenInTheChart) {
  const RotorConstants chart = ToChart(Case(2.0).truth.constants);
  RotorConstants step = RotorConstants::Zero();
  step.segment<3>(kInertiaConstants).setConstant(1.5);
  EXPECT_EQ(MovedInChart(chart, step), RotorConstants(chart + step));
}

// Sum of the squared errors of the constants over their variances, by their whole covariance.
double SquaredErrors(const Case& c, const RotorBatchResult& result) {
  const std::vector<int> free = c.options.prior.Free();
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::VectorXd error(n);
  Eigen::MatrixXd cov(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    error[i] = result.mean[free[i]] - c.truth.constants[free[i]];
    for (Eigen::Index j = 0; j < n; ++j) cov(i, j) = result.cov(free[i], free[j]);
  }
  return error.dot(cov.llt().solve(error));
}

// Flights with new noise and first guesses: squared errors of the constants, and the sum of all
// squared rows, are chi-square.
TEST(RotorBatch, SlowErrorsAreAsLargeAsStated) {
  double errors = 0.0, errors_freedom = 0.0, rows = 0.0, rows_freedom = 0.0;
  for (std::uint64_t seed = 11; seed < 17; ++seed) {
    const Case c(8.0, seed);
    const RotorBatchResult result = RunRotorBatch(c.model, c.data, c.options);
    EXPECT_TRUE(result.converged) << seed;
    errors += SquaredErrors(c, result);
    errors_freedom += static_cast<double>(c.options.prior.Free().size());
    rows += 2.0 * result.cost;
    // Degrees of freedom: the prior's rows balance the constants; each node takes its errors.
    rows_freedom += result.residuals - kNodeErrors * static_cast<double>(result.nodes.size());
  }
  ExpectChiSquare(errors, errors_freedom, "constants");
  EXPECT_NEAR(rows / rows_freedom, 1.0, 3.1 * std::sqrt(2.0 / rows_freedom));
}

TEST(RotorBatch, FindsDragThatFliesWithTheVehicle) {
  Case c(8.0);
  c.sim.drag = {-0.5, -0.3, -0.2};
  c.data = MakeRotorData(SimulateRotorFlight(c.sim, RandomPath(8.0, 4), 2), 4, {});
  for (const char* name : {"K_x", "K_y", "K_z"})
    c.options.prior.sigma[FindRotorConstant(name)] = 1.0;
  const RotorBatchResult result = RunRotorBatch(c.model, c.data, c.options);
  const RotorConstants sigma = result.Sigma();
  constexpr double kDue[] = {0.135, 0.163, 0.103};  // 1/s, observed on this flight
  for (int i = 0; i < 3; ++i) {
    const int k = FindRotorConstant("K_x") + i;
    EXPECT_LT(std::abs(result.mean[k] - c.sim.drag[i]), 3.3 * sigma[k]);  // 0.1 %
    ExpectSigma(sigma[k], kDue[i], 1.4, kRotorConstants[k].name);
  }
}

// The evidence has its maximum at the true disturbance.
TEST(RotorBatch, EvidenceFindsTheDisturbance) {
  Case c(4.0);
  std::vector<double> evidence;
  for (const double factor : {0.4, 1.0, 2.5}) {
    c.options.noise.force_density = factor * c.sim.noise.force_density;
    evidence.push_back(RunRotorBatch(c.model, c.data, c.options).log_evidence);
  }
  EXPECT_GT(evidence[1], evidence[0] + 3.0);
  EXPECT_GT(evidence[1], evidence[2] + 3.0);
}

TEST(RotorBatch, ItsSolutionDoesNotDependOnTheCovariance) {
  Case c(4.0);
  const RotorBatchResult whole = RunRotorBatch(c.model, c.data, c.options);
  c.options.covariance = false;
  const RotorBatchResult bare = RunRotorBatch(c.model, c.data, c.options);
  EXPECT_EQ(bare.cov.size(), 0);
  EXPECT_EQ(bare.mean, whole.mean);
  EXPECT_EQ(bare.cost, whole.cost);
}

// Largest difference of the constants, in sigmas of `b`.
double Apart(const RotorBatchResult& a, const RotorBatchResult& b) {
  double apart = 0.0;
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    if (b.Sigma()[i] > 0.0) apart = std::max(apart, std::abs(a.mean[i] - b.mean[i]) / b.Sigma()[i]);
  }
  return apart;
}

// Moments from an inertia that is wrong by half: the rotation is then unmodelled to a large part,
// and the accelerometer shows it through the arm. Weights evaluated at the solution, at the arm
// that it has, leave the solution where it is.
TEST(RotorBatch, AnArmStandsWhereMomentsAreModelledBadly) {
  Case c(6.0);
  c.options.noise.angular_density = 3.0;
  c.options.prior.mean.segment<3>(1) *= 1.5;
  c.options.prior.sigma.segment<3>(1).setZero();
  c.options.reweights = 1;
  const RotorBatchResult once = RunRotorBatch(c.model, c.data, c.options);
  c.options.reweights = 2;
  const RotorBatchResult twice = RunRotorBatch(c.model, c.data, c.options);
  const int arm = FindRotorConstant("r_BI_x");
  for (int i = arm; i < arm + 3; ++i) {
    EXPECT_NEAR(once.mean[i], twice.mean[i], 0.3 * twice.Sigma()[i]) << i;
    EXPECT_NEAR(twice.mean[i], c.truth.constants[i], 4.0 * twice.Sigma()[i]) << i;
  }
}

// Prior and flight disagree about the inertia so far that the optimum would be unphysical: it ends
// flat. A solve from the flat solution takes few iterations and stays there; from there a solution
// that is not flat is found as well.
TEST(RotorBatch, AFlatBodyHoldsNothingUp) {
  Case c(4.0);
  c.options.reweights = 3;
  const Eigen::Vector3d truth = c.truth.constants.segment<3>(1);
  c.options.prior.mean.segment<3>(1) = truth;
  c.options.prior.sigma.segment<3>(1) = 0.3 * truth;
  const RotorBatchOptions fair = c.options;
  c.options.prior.mean.segment<3>(1) = Eigen::Vector3d(0.3, 0.3, 0.24).cwiseProduct(truth);
  c.options.prior.sigma.segment<3>(1) = Eigen::Vector3d(0.01, 0.01, 0.3).cwiseProduct(truth);

  const RotorBatchResult flat = RunRotorBatch(c.model, c.data, c.options);
  EXPECT_NEAR(flat.mean[3], flat.mean[1] + flat.mean[2], 1e-5 * flat.mean[3]);
  const RotorBatchResult again = RunRotorBatch(c.model, c.data, c.options, &flat);
  EXPECT_TRUE(again.converged);
  EXPECT_LE(again.iterations, 4);
  EXPECT_LT(Apart(again, flat), 0.1);

  const RotorBatchResult thick = RunRotorBatch(c.model, c.data, fair);
  EXPECT_LT(thick.mean[3], 0.9 * (thick.mean[1] + thick.mean[2]));
  EXPECT_LT(Apart(RunRotorBatch(c.model, c.data, fair, &flat), thick), 0.1);
}

// A map that oscillates along one direction and converges slowly along another.
TEST(FixedPoint, FindsItInAFewValues) {
  RotorConstants want = RotorConstants::Zero(), scale = want, x = want;
  want.head<2>() << 1.0, 2.0;
  scale.head<2>() << 1e-3, 1.0;
  FixedPoint fixed_point;
  for (int i = 0; i < 4; ++i) {
    RotorConstants image = want;
    image[0] += 0.8 * (x[0] - want[0]);
    image[1] -= 0.9 * (x[1] - want[1]);
    x = fixed_point.Next(x, image, scale);
  }
  EXPECT_LT((x - want).norm(), 1e-9);
}

TEST(RotorBatch, RefusesImpossiblePriors) {
  Case c(2.0);
  c.options.prior.sigma[FindRotorConstant("I_z")] = 0.0;
  EXPECT_THROW(RunRotorBatch(c.model, c.data, c.options), InputError);
}

}  // namespace
}  // namespace trueline
