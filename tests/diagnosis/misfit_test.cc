// Open-loop replays of simulated flights whose misfit is known.
#include "problems/diagnosis/misfit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "problems/common/random.h"
#include "problems/diagnosis/imu_flight.h"
#include "tests/common/bands.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

struct Replayed {
  testing_simulation::Flown flown;
  Misfit misfit;
};

Replayed ReplayFlight(const std::vector<Effect>& effects) {
  SimulationConfig config = testing_simulation::ReadShipped("iros2016", 60.0);
  config.effects = effects;
  config.detector.sigma_factor = 0.02;
  Replayed out{testing_simulation::Fly(config, 4), {}};
  const FlightLog& log = out.flown.log;
  const ImuDrivenFlight flight(PrepareLog(log, ImuDiagnosisOptions()));
  out.misfit = MisfitOf(flight, flight.ReplayOpenLoop(), {});
  return out;
}

double After(const Misfit& misfit, double horizon) {
  for (const MisfitGrowth& g : misfit.growth) {
    if (std::abs(g.horizon - horizon) < 0.12 * horizon) return g.before_E.head<2>().norm();
  }
  ADD_FAILURE() << "no replays of " << horizon << " s";
  return 0.0;
}

TEST(Misfit, GrowsWithTheHorizonAndShowsAHeadingThatIsBent) {
  const Misfit clean = ReplayFlight({}).misfit;
  EXPECT_EQ(clean.measured_by, "mocap");
  EXPECT_LT(After(clean, 0.25), 0.02);
  EXPECT_LT(After(clean, 1.0), 0.15);
  EXPECT_GT(After(clean, 2.0), After(clean, 0.5));

  const Replayed bent = ReplayFlight({{"heading_distortion", {{"a_sin", 0.2}, {"a_cos", 0.1}}}});
  EXPECT_GT(After(bent.misfit, 1.0), 2.0 * After(clean, 1.0));
  double heading = 0.0, time = 1.0;
  for (const MisfitShare& share : bent.misfit.shares) {
    EXPECT_GE(std::min(share.body, share.earth), 0.0) << share.by;
    EXPECT_LE(std::max(share.body, share.earth), 1.0) << share.by;
    if (share.by == "heading") heading = std::max(share.body, share.earth);
    if (share.by == "time") time = std::max(share.body, share.earth);
  }
  EXPECT_GT(heading, 0.3);
  EXPECT_LT(time, 0.2);
}

// An error has the same length in all frames, and the parts of a row are consistent.
TEST(Misfit, RowsSayWhereTheErrorAroseAndWithWhat) {
  const Replayed flight = ReplayFlight({});
  ASSERT_GT(flight.misfit.rows.size(), 200U);
  int near_gates = 0;
  for (const MisfitRow& row : flight.misfit.rows) {
    EXPECT_NEAR(row.before.error_E.norm(), row.before.error_B.norm(), 1e-9);
    EXPECT_GT(row.at.speed, 0.2);
    EXPECT_GT(row.at.height, 0.0);
    EXPECT_TRUE(std::isnan(row.at.battery));  // not logged
    near_gates += row.at.gate >= 0;
    EXPECT_FALSE(row.at.gate >= 0 && !(row.at.gate_distance < 12.0)) << row.at.gate_distance;
  }
  EXPECT_GT(near_gates, 50);
}

// Mean and standard deviation of the rows' values less the simulator's at their middles.
struct Differences {
  int count = 0;
  double mean = 0.0, spread = 0.0;
};

using TruthOf = std::function<double(const simulation::TruthSample&)>;
Differences Compare(const Replayed& flight, double ReplaySituation::*value, const TruthOf& truth) {
  Differences d;
  double squares = 0.0;
  for (const MisfitRow& row : flight.misfit.rows) {
    const auto at = static_cast<std::size_t>(std::lround(row.at.time * 512.0));
    const double difference = row.at.*value - truth(flight.flown.truth.trajectory.at(at));
    d.mean += difference;
    squares += difference * difference;
    ++d.count;
  }
  d.mean /= d.count;
  d.spread = std::sqrt(squares / d.count - d.mean * d.mean);
  return d;
}

// A quantity of the rows: its constant offset from the truth, and the spread about it.
struct Quantity {
  std::string name;
  double ReplaySituation::*value;
  TruthOf truth;
  double offset, spread;
};

// Expected offsets: thrust is the accelerometer's reading, with b_az of -0.12 and the rotors'
// vibration, without scale. Gyro biases and noise increase the rate. Speed and place are those of
// the knot before. Spreads are observed ones; a mean is within 3.3 (0.1 %) of its standard errors.
TEST(Misfit, RowsSayHowTheVehicleFlew) {
  using S = const simulation::TruthSample&;
  using At = ReplaySituation;
  const std::vector<Quantity> quantities = {
      {"thrust", &At::thrust, [](S s) { return -s.f_B.z(); }, 0.12, 0.27},
      {"speed", &At::speed, [](S s) { return s.v_E.norm(); }, 0.0, 0.15},
      {"rate", &At::rate, [](S s) { return s.w_B.norm(); }, 0.003, 0.022},
      {"height", &At::height, [](S s) { return -s.p_E.z(); }, 0.0, 0.022},
      {"north", &At::north, [](S s) { return s.p_E.x(); }, 0.0, 0.21},
      {"east", &At::east, [](S s) { return s.p_E.y(); }, 0.0, 0.20}};
  const Replayed flight = ReplayFlight({});
  for (const Quantity& q : quantities) {
    const Differences d = Compare(flight, q.value, q.truth);
    EXPECT_NEAR(d.mean, q.offset, 3.3 * q.spread / std::sqrt(d.count)) << q.name;
    ExpectSigma(d.spread, q.spread, 1.4, q.name);
  }
}

// --- Shares of the variance of errors.

TEST(VarianceShares, BinsHoldEqualNumbersAndNoneForNoValue) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(QuantileBins({5.0, 1.0, none, 3.0, 9.0}, 2), (std::vector<int>{1, 0, -1, 0, 1}));
  EXPECT_EQ(QuantileBins({2.0, 2.0, 2.0}, 3), (std::vector<int>{0, 0, 0}));
}

// Two groups at +-1 with noise of 0.5 have a share of 1 / (1 + 0.25).
TEST(VarianceShares, IsThatBetweenTheGroups) {
  Random random(2, "groups");
  std::vector<Eigen::Vector2d> errors, noise;
  std::vector<int> bin;
  for (int i = 0; i < 400; ++i) {
    bin.push_back(i % 2);
    noise.emplace_back(0.5 * random.Normal(), 0.0);
    errors.push_back(noise.back() + Eigen::Vector2d(i % 2 == 0 ? 1.0 : -1.0, 0.0));
  }
  const VarianceShare shown = VarianceShareOf(errors, bin), chance = VarianceShareOf(noise, bin);
  EXPECT_NEAR(shown.share, 0.8, 0.03);
  EXPECT_LT(shown.p, 1e-10);
  EXPECT_LT(chance.share, 0.02);
  EXPECT_GT(chance.p, 0.001);
  EXPECT_EQ(VarianceShareOf(noise, std::vector<int>(400, 3)).share, 0.0);  // a single group
                                                                           // explains nothing
}

}  // namespace
}  // namespace trueline
