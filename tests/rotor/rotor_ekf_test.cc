#include "problems/rotor/rotor_ekf.h"

#include <gtest/gtest.h>

#include "problems/rotor/rotor_batch.h"
#include "tests/common/bands.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

struct FilterCase {
  RotorSimulation sim{WuestVehicle()};
  RotorAeroModel model = EstimationModel(sim.vehicle);
  RotorTruth truth;
  RotorData data;
  RotorEkfOptions options;

  // Noise and first guess are drawn from `seed`.
  FilterCase(double duration, bool attitude, std::uint64_t seed = 0) {
    const FlightLog log = SimulateRotorFlight(sim, RandomPath(duration, 4), 11 + seed, &truth);
    RotorDataOptions stream;
    stream.attitude = attitude;
    data = MakeRotorData(log, 4, stream);
    options.noise = sim.noise;
    options.prior = DrawnPrior(sim.vehicle, 5 + seed);
  }
  RotorEkfRun Run() const { return RunRotorEkf(model, data, options); }
  // Mean of the squared errors of the constants over their variances, by their whole covariance.
  double Nees(const RotorEkfRun& run) const {
    const std::vector<int> free = options.prior.Free();
    const auto n = static_cast<Eigen::Index>(free.size());
    Eigen::VectorXd error(n);
    Eigen::MatrixXd cov(n, n);
    const int first = RotorAeroModel::kMovingErrors;
    for (Eigen::Index i = 0; i < n; ++i) {
      error[i] = run.history.back().mean[free[i]] - truth.constants[free[i]];
      for (Eigen::Index j = 0; j < n; ++j) cov(i, j) = run.cov(first + free[i], first + free[j]);
    }
    return error.dot(cov.llt().solve(error)) / static_cast<double>(n);
  }
};

// 31 states of the paper: 13 moving and 18 constants.
TEST(RotorEkf, EstimatesThePapersStates) {
  EXPECT_EQ(PriorFromVehicle(WuestVehicle()).Free().size() + RotorAeroModel::kMoving, 31u);
}

// On a flight of the model itself the stated ellipsoids hold the measured positions.
TEST(RotorEkf, ForecastsErrAsTheyState) {
  FilterCase c(12.0, true);
  c.options.prior.mean = c.truth.constants;
  c.options.prior.sigma.setZero();
  const RotorEkfRun plain = c.Run();
  c.options.forecast = {{0.25, 1.0}, 0.2, 1.0};
  const RotorEkfRun run = c.Run();
  EXPECT_EQ(run.state, plain.state);  // a forecast leaves the filter as it was
  ASSERT_GT(run.forecasts.size(), 80u);
  int inside = 0;
  double near = 0.0, far = 0.0;
  for (const RotorForecast& f : run.forecasts) {
    inside += f.rank <= 0.9;
    (f.horizon < 0.5 ? near : far) += f.error;
  }
  const double share = static_cast<double>(inside) / static_cast<double>(run.forecasts.size());
  EXPECT_GT(share, 0.75);
  EXPECT_LT(share, 0.99);
  EXPECT_GT(far, 2.0 * near);
}

// Over flights with new noise and first guesses, the squared errors of all constants over their
// variances sum to chi-square with 18 degrees of freedom for each flight.
TEST(RotorEkf, SlowErrorsAreAsLargeAsStated) {
  constexpr int kSeeds = 24;
  for (const bool attitude : {true, false}) {
    double sum = 0.0;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const FilterCase c(10.0, attitude, seed);
      sum += 18.0 * c.Nees(c.Run());
    }
    ExpectChiSquare(sum, 18.0 * kSeeds, attitude ? "poses" : "positions alone");
  }
}

TEST(RotorEkf, KnowsMassInertiaAndCentreOfMass) {
  const FilterCase c(10.0, true);
  const RotorEkfRun run = c.Run();
  for (const char* name : {"m", "I_x", "I_y", "r_BM_x", "r_BM_y"}) {
    const int i = FindRotorConstant(name);
    EXPECT_LT(run.history.back().sigma[i], 0.2 * c.options.prior.sigma[i]) << name;
  }
}

// A guess of the inertia at 0.4 of the truth (two sigmas low, as on one flight in twenty), and a
// mass at 0.7. An ordinary filter then becomes certain of a wrong value.
TEST(RotorEkf, SurvivesAGuessThatIsFarTooSmall) {
  double ordinary = 0.0;
  for (const char* name : {"I_x", "I_y", "I_z"}) {
    FilterCase c(6.0, true);
    const int i = FindRotorConstant(name);
    c.options.prior = PriorFromVehicle(WuestVehicle());
    c.options.prior.mean = c.truth.constants;
    c.options.prior.mean[i] *= 0.4;
    c.options.prior.mean[0] *= 0.7;
    EXPECT_LT(c.Nees(c.Run()), 2.0) << name;
    c.options.passes = 0;
    ordinary = std::max(ordinary, c.Nees(c.Run()));
  }
  EXPECT_GT(ordinary, 3.0);
}

// The batch's bound is computed by other code (shooting, elimination along a chain); the filter's
// covariance must agree with it.
TEST(RotorEkf, CovarianceAgreesWithTheBatchsBound) {
  FilterCase c(10.0, true);
  RotorBatchOptions batch;
  batch.noise = c.options.noise;
  batch.prior = c.options.prior;
  std::vector<RotorNode> nodes;
  for (const RotorPose& pose : c.data.poses) {
    nodes.push_back({c.truth.states[std::lround(pose.t * c.sim.imu_rate)]});
  }
  const Eigen::MatrixXd bound = RotorBound(c.model, c.data, batch, nodes, c.truth.constants);
  c.options.prior.mean = c.truth.constants;  // linearised near the truth
  const RotorEkfRun run = c.Run();
  for (const int i : c.options.prior.Free()) {
    EXPECT_NEAR(run.history.back().sigma[i] / std::sqrt(bound(i, i)), 1.0, 0.15)
        << kRotorConstants[i].name;
  }
}

TEST(RotorEkf, PositionsAloneWithImuAreEnough) {
  const FilterCase c(10.0, false);
  const RotorEkfRun run = c.Run();
  const int mass = FindRotorConstant("m");
  EXPECT_LT(run.history.back().sigma[mass], 0.05 * c.options.prior.sigma[mass]);
}

TEST(RotorEkf, KnownConstantsStayAndWanderWidens) {
  FilterCase c(3.0, true);
  const int inflow = FindRotorConstant("inflow"), bias = FindRotorConstant("b_a_x");
  const RotorEkfRun still = c.Run();
  EXPECT_EQ(still.history.back().mean[inflow], 0.0);
  EXPECT_EQ(still.history.back().sigma[inflow], 0.0);
  c.options.wander = 0.3;
  const RotorEkfRun wandering = c.Run();
  EXPECT_GT(wandering.history.back().sigma[bias], 1.2 * still.history.back().sigma[bias]);
}

}  // namespace
}  // namespace trueline
