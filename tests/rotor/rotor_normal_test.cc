// The linearised batch against the batch itself, and force columns against differences of the
// model.
#include "problems/rotor/rotor_normal.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "problems/common/random.h"
#include "problems/effects/declaration.h"
#include "problems/effects/effect.h"
#include "problems/rotor/rotor_segment.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

using Weight = SegmentWeight;

struct Solved {
  RotorSimulation sim{WuestVehicle()};
  RotorAeroModel model = EstimationModel(sim.vehicle);
  RotorTruth truth;
  RotorData data = MakeRotorData(SimulateRotorFlight(sim, RandomPath(5.0, 2), 4, &truth), 4, {});
  RotorBatchOptions options{sim.noise, DrawnPrior(sim.vehicle, 1)};
  RotorBatchResult batch = RunRotorBatch(model, data, options);
};

// The largest step to the least cost, in sigmas.
double LargestStep(const RotorNormal& normal) {
  const Eigen::MatrixXd cov = normal.M().inverse();
  return (cov * normal.b()).cwiseQuotient(cov.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff();
}

TEST(RotorNormal, ItsInverseIsTheBatchsCovariance) {
  const Solved s;
  const RotorNormal normal(s.model, s.data, s.options, s.batch, {}, 1.0);
  const std::vector<int> free = s.options.prior.Free();
  const Eigen::MatrixXd cov = normal.M().inverse();
  ASSERT_EQ(normal.border(), static_cast<int>(free.size()));
  EXPECT_EQ(normal.clusters(), 4);
  for (int i = 0; i < normal.border(); ++i) {
    const double unit = s.options.prior.sigma[free[i]];
    EXPECT_NEAR(cov(i, i) * unit * unit / s.batch.cov(free[i], free[i]), 1.0, 0.02);
  }
  // At the solution the gradient is zero, compared with that a tenth of a sigma away.
  EXPECT_LT(LargestStep(normal), 0.1);
}

TEST(RotorNormal, AFitIsTheLeastCostWithItsOwnWeights) {
  const Solved s;
  RotorBatchResult elsewhere = s.batch;  // other inertia: disturbances move the body otherwise
  elsewhere.mean.segment<3>(kInertiaConstants) *= 4.0;
  const RotorWeights weights{s.model, s.data, elsewhere};
  const RotorBatchResult fit = RunRotorBatch(s.model, s.data, s.options, &s.batch, &weights);
  const RotorNormal own(s.model, s.data, s.options, fit, {}, 1.0, &weights);
  const RotorNormal anew(s.model, s.data, s.options, fit, {}, 1.0);
  EXPECT_LT(LargestStep(own), 0.05);
  EXPECT_GT(LargestStep(anew), 2.0 * LargestStep(own));
}

// The largest error of the columns of `effects` by the differences of segments, as a share.
double ColumnError(const Solved& s, const std::vector<Effect>& effects) {
  const RotorAeroModel moved(s.sim.vehicle.model.rotors(), 9.81, RotorExtensionOf(effects).effects);
  const auto accelerations = [&](double t, const RotorState& x, Eigen::MatrixXd* out) {
    const RotorInput input = s.data.InputAt(t);
    const auto a = s.model.BodyAccelerationOf(x.data(), input),
               b = moved.BodyAccelerationOf(x.data(), input);
    out->topRows<6>() << b.force - a.force, b.turn - a.turn;
  };
  const std::vector<RotorSegment> segments = CutSegments(s.data);
  double largest = 0.0;
  for (const int i : {3, 40, 90}) {
    const SegmentModel base(s.model, s.data, s.options.noise, segments[i]);
    const SegmentModel other(moved, s.data, s.options.noise, segments[i]);
    const RotorNode &start = s.batch.nodes[i], &next = s.batch.nodes[i + 1];
    const Eigen::VectorXd difference = other.Evaluate(start, next, s.batch.mean, false).error -
                                       base.Evaluate(start, next, s.batch.mean, false).error;
    const Eigen::VectorXd slope =
        base.Respond(base.Follow(start, s.batch.mean), next, 1, accelerations);
    largest = std::max(largest, (difference - slope).norm() / difference.norm());
  }
  return largest;
}

TEST(RotorNormal, ColumnsAreTheSlopesOfASegment) {
  const Solved s;
  EXPECT_LT(ColumnError(s, {{"com_step", {{"t_step", 0.0}, {"dx", 1e-6}, {"dy", 2e-6}}},
                            {"rotor_speed_drag", {{"k", 2e-9}}}}),
            0.02);
}

// The rate changes within a step, by the moments that the model knows: a column taken at the start
// of each step has a part that goes with these moments. The model has a constant for each of these
// terms, so an error of the column is what a test of it would find.
TEST(RotorNormal, ColumnsOfWhatGoesWithRatesAreTheSlopesOfASegment) {
  const Solved s;
  for (const char* symbol : {"p", "q", "r"}) {
    Effect term{"term", {{"size", 1e-4}}};
    term.term = std::make_shared<TermForm>(ParseTerm("moment_z", symbol));
    EXPECT_LT(ColumnError(s, {term}), 1e-5) << symbol;
  }
}

// A wrong reading of the pose sensor: its column recovers its size.
TEST(RotorNormal, ReadingsOfPosesAreColumns) {
  Solved s;
  constexpr double kTurn = 0.01, kShift = 0.01;  // rad about z_E, m along z_E
  const auto part = [](double t) { return std::sin(8.0 * t); };
  for (RotorPose& pose : s.data.poses) {
    pose.q_E_P = Eigen::AngleAxisd(kTurn * part(pose.t), Eigen::Vector3d::UnitZ()) * pose.q_E_P;
    pose.p_E.z() += kShift * part(pose.t);
  }
  s.batch = RunRotorBatch(s.model, s.data, s.options);
  RotorColumns columns{
      2,
      [](double, const RotorState&, Eigen::MatrixXd* accelerations) { accelerations->setZero(); },
      [&](double t, const RotorState& x, Eigen::MatrixXd* read) {
        const Eigen::Quaterniond q(x[0], x[1], x[2], x[3]);
        const Eigen::Vector3d down = q.normalized().inverse() * Eigen::Vector3d::UnitZ();
        read->col(0).tail<3>() = part(t) * down;
        (*read)(2, 1) = part(t);
      }};
  const RotorNormal normal(s.model, s.data, s.options, s.batch, columns, 1.0);
  const Eigen::VectorXd step = -normal.M().llt().solve(normal.b());
  const Eigen::VectorXd sigma = normal.M().inverse().diagonal().cwiseSqrt();
  const int first = normal.constants();
  EXPECT_LT(sigma[first], 0.3 * kTurn);
  EXPECT_NEAR(step[first], kTurn, 3.0 * sigma[first]);
  EXPECT_LT(sigma[first + 1], 0.3 * kShift);
  EXPECT_NEAR(step[first + 1], kShift, 3.0 * sigma[first + 1]);
}

// If scores vary between clusters as the noise predicts, cluster intervals equal the noise's.
TEST(RotorNormal, ClusterCovarianceAgreesWhereTheModelIsExact) {
  const Solved s;
  const RotorNormal normal(s.model, s.data, s.options, s.batch, {}, 0.25);
  const Eigen::MatrixXd cov = normal.ClusterCovariance();
  double ratio = 0.0;
  for (const int i : s.options.prior.Free()) ratio += std::sqrt(cov(i, i) / s.batch.cov(i, i));
  EXPECT_NEAR(ratio / 18.0, 1.0, 0.25);
}

// --- Innovations against the dense covariance of all rows.

template <int kRows, int kCols>
Eigen::Matrix<double, kRows, kCols> Drawn(Random* random, double size) {
  return Eigen::Matrix<double, kRows, kCols>::NullaryExpr(
      [&](Eigen::Index, Eigen::Index) { return size * random->Normal(); });
}

// A segment of random steps; `with_reading` says which of them start with a reading. Rows and their
// influence by all disturbances and noises are kept side by side.
struct Steps {
  Weight weight;
  // Rows x disturbances, then the noise of each step by state, then one column for each row's
  // noise.
  Eigen::MatrixXd influence;

  explicit Steps(const std::vector<bool>& with_reading, std::uint64_t seed) {
    Random random(seed, "steps");
    const auto steps = static_cast<Eigen::Index>(with_reading.size());
    const auto readings = std::count(with_reading.begin(), with_reading.end(), true);
    const Eigen::Index rows = 6 * readings + Weight::kState;
    const Eigen::Index noise = (6 + Weight::kState) * steps;  // where the rows' noise begins
    influence.setZero(rows, noise + rows);
    Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(Weight::kState, influence.cols());
    Eigen::Index row = 0;
    for (Eigen::Index k = 0; k < steps; ++k) {
      if (with_reading[k]) {
        const Weight::ReadingByState H = Drawn<6, Weight::kState>(&random, 1.0);
        const Weight::ReadingSquare D = Drawn<6, 6>(&random, 1.0);
        const Weight::Reading sigma = Drawn<6, 1>(&random, 0.3);
        weight.Read(H, D, sigma.cwiseAbs2());
        influence.middleRows(row, 6) = H * moved;
        influence.block<6, 6>(row, 6 * k) += D;  // the disturbance that also moves the state
        for (int i = 0; i < 6; ++i) influence(row + i, noise + row + i) = sigma[i];
        row += 6;
      }
      const Weight::StateByState F =
          Weight::StateByState::Identity() + Drawn<Weight::kState, Weight::kState>(&random, 0.2);
      const Weight::StateByReading G = Drawn<Weight::kState, 6>(&random, 0.5);
      const Weight::State own = Drawn<Weight::kState, 1>(&random, 0.2);
      weight.Step(F, G, own.cwiseAbs2());
      moved = (F * moved).eval();
      moved.middleCols<6>(6 * k) += G;
      moved.middleCols<Weight::kState>(6 * steps + Weight::kState * k).diagonal() += own;
    }
    const Weight::State sigma = Drawn<Weight::kState, 1>(&random, 0.1);
    weight.End(sigma.cwiseAbs2());
    influence.bottomRows(Weight::kState) = moved;
    for (int i = 0; i < Weight::kState; ++i) influence(row + i, noise + row + i) = sigma[i];
  }
};

class SegmentWeightTest : public testing::TestWithParam<std::vector<bool>> {};

TEST_P(SegmentWeightTest, IsThatOfTheDenseCovariance) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Steps steps(GetParam(), seed);
    const Eigen::MatrixXd cov = steps.influence * steps.influence.transpose();
    const Eigen::LLT<Eigen::MatrixXd> llt(cov);
    ASSERT_EQ(llt.info(), Eigen::Success);
    Random random(seed, "rows");
    Eigen::MatrixXd rows(cov.rows(), 5);
    for (double& x : rows.reshaped()) x = random.Normal();
    const Eigen::MatrixXd expected = llt.matrixL().solve(rows);
    Eigen::MatrixXd whitened = rows;
    steps.weight.Whiten(whitened);
    EXPECT_LT((whitened - expected).norm(), 1e-9 * expected.norm());
    // Quadratic forms, which do not depend on the choice of the root.
    const Eigen::MatrixXd forms = rows.transpose() * llt.solve(rows);
    EXPECT_LT((whitened.transpose() * whitened - forms).norm(), 1e-9 * forms.norm());
    const double log_determinant = 2.0 * llt.matrixLLT().diagonal().array().log().sum();
    EXPECT_NEAR(steps.weight.LogDeterminant(), log_determinant,
                1e-9 * (1.0 + std::abs(log_determinant)));
    // The covariance is not diagonal: whitening by its diagonal differs.
    const Eigen::MatrixXd scaled = cov.diagonal().cwiseSqrt().cwiseInverse().asDiagonal() * rows;
    EXPECT_GT((scaled - expected).norm(), 0.1 * expected.norm());
  }
}

TEST_P(SegmentWeightTest, RowsOfTheEndAloneStayThere) {
  const Steps steps(GetParam(), 4);
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(steps.influence.rows(), Weight::kState);
  rows.bottomRows<Weight::kState>().setIdentity();
  Eigen::MatrixXd end = rows.bottomRows<Weight::kState>();
  steps.weight.WhitenEnd(end);
  steps.weight.Whiten(rows);
  EXPECT_EQ(rows.topRows(rows.rows() - Weight::kState).norm(), 0.0);
  EXPECT_LT((rows.bottomRows<Weight::kState>() - end).norm(), 1e-12 * end.norm());
}

INSTANTIATE_TEST_SUITE_P(Segments, SegmentWeightTest,
                         testing::Values(std::vector<bool>{true, true, true, true, true},
                                         std::vector<bool>{false, true, false, false, true, true},
                                         std::vector<bool>{false, false, true, false},
                                         std::vector<bool>{false, false}));

}  // namespace
}  // namespace trueline
