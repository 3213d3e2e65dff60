// Open-loop replays of simulated flights whose misfit is known.
#include "problems/diagnosis/misfit.h"

#include <gtest/gtest.h>

#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

struct Replayed {
  FlightLog log;
  Misfit misfit;
};

Replayed ReplayFlight(const std::vector<simulation::EffectSetting>& effects) {
  SimulationConfig config = testing_simulation::ReadShipped("iros2016");
  config.duration = 60.0;
  config.effects = effects;
  config.detector.sigma_factor = 0.02;
  Replayed out{testing_simulation::Fly(config, 4).log, {}};
  CauseSearch search(out.log, VgdOptions());
  std::vector<Found> none;
  search.Fit(&none, 0);
  out.misfit = TakeApart(out.log, &search, ReplayOpenLoop(&search, out.log), {});
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
  EXPECT_TRUE(clean.against_mocap);
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

// An error has the same length in all axes, and the parts of a row belong together.
TEST(Misfit, RowsSayWhereTheErrorAroseAndWithWhat) {
  const Replayed flight = ReplayFlight({});
  ASSERT_GT(flight.misfit.rows.size(), 200U);
  int near_gates = 0;
  for (const MisfitRow& row : flight.misfit.rows) {
    EXPECT_NEAR(row.before.error_E.norm(), row.before.error_B.norm(), 1e-9);
    EXPECT_GT(row.at.speed, 0.2);
    EXPECT_NEAR(row.at.thrust, 9.8, 6.0);
    EXPECT_GT(row.at.height, 0.0);
    EXPECT_TRUE(std::isnan(row.at.battery));  // not logged
    near_gates += row.at.gate >= 0;
    EXPECT_FALSE(row.at.gate >= 0 && !(row.at.gate_distance < 12.0)) << row.at.gate_distance;
  }
  EXPECT_GT(near_gates, 50);
}

}  // namespace
}  // namespace trueline
