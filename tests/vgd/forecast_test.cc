// Forecasts at fixed horizons: where they exist, and that their regions hold the truth as often as
// they say.
#include <gtest/gtest.h>

#include "problems/vgd/vgd.h"
#include "problems/vgd/window_estimate.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

FlightLog Fly(std::uint64_t seed) {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome");
  config.duration = 40.0;
  return testing_simulation::Fly(config, seed).log;
}

std::vector<Forecast> ForecastsOf(const FlightLog& log, const std::vector<double>& horizons) {
  const VgdOptions options;
  const FlightData flight(log, options.drive, options.passes, options.drag_measurement);
  std::vector<Forecast> forecasts;
  for (const WindowEstimate& window : RunVgd(flight, options).windows) {
    const auto more = ForecastAfter(flight, options, window.tau, ThetaOf(window), horizons);
    forecasts.insert(forecasts.end(), more.begin(), more.end());
  }
  return forecasts;
}

TEST(Forecast, ErrorsGrowWithTheHorizonAndLieInsideTheirRegions) {
  int near = 0, far = 0, inside = 0;
  double near_error = 0.0, far_error = 0.0;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    for (const Forecast& f : ForecastsOf(Fly(seed), {0.1, 1.0})) {
      (f.horizon < 0.5 ? near : far) += 1;
      (f.horizon < 0.5 ? near_error : far_error) += f.error;
      inside += f.rank <= 0.95;
      EXPECT_GT(f.sigma, 0.0);
    }
  }
  ASSERT_GT(far, 15);
  EXPECT_EQ(near, far);
  EXPECT_GT(far_error, 1.5 * near_error);
  EXPECT_GE(inside, 0.85 * (near + far));
}

TEST(Forecast, ThereIsNoneBeyondTheArcOrWithoutMocap) {
  FlightLog log = Fly(1);
  EXPECT_TRUE(ForecastsOf(log, {60.0}).empty());
  log.mocap.clear();
  EXPECT_TRUE(ForecastsOf(log, {0.1}).empty());
}

// Without mocap the truth of an arc's end comes from the next pass's fixes, which err themselves.
TEST(ArcAfter, TruthByFixesHasTheirSigma) {
  FlightLog log = Fly(1);
  const VgdOptions options;
  const auto inside_of = [&](double* sigma) {
    const FlightData flight(log, options.drive, options.passes, options.drag_measurement);
    int inside = 0, count = 0;
    for (const WindowEstimate& window : RunVgd(flight, options).windows) {
      if (!window.arc || !window.arc->truth) continue;
      *sigma = window.arc->truth_sigma;
      inside += window.arc->Inside95();
      ++count;
    }
    EXPECT_GT(count, 8);
    return static_cast<double>(inside) / count;
  };
  double sigma = 0.0;
  EXPECT_GE(inside_of(&sigma), 0.8);
  EXPECT_EQ(sigma, 0.0);
  log.mocap.clear();
  EXPECT_GE(inside_of(&sigma), 0.8);
  EXPECT_GT(sigma, 0.05);
}

}  // namespace
}  // namespace trueline
