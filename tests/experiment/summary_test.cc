// Intervals and convergence times against known answers.
#include <gmock/gmock.h>

#include <cmath>

#include "problems/common/random.h"
#include "problems/experiment/accuracy.h"
#include "problems/experiment/benchmark_summary.h"

namespace trueline {
namespace {

TEST(Bootstrap, IntervalOfAMeanIsThatOfTheNormal) {
  Random random(1);
  std::vector<std::vector<double>> flights(400);
  std::vector<double> means;
  for (auto& flight : flights) {
    const double shared = random.Normal();  // common to all arcs of one flight
    for (int i = 0; i < 5; ++i) flight.push_back(3.0 + shared + 0.1 * random.Normal());
    means.push_back(Mean(flight));
  }
  const double centre = Mean(means);
  double variance = 0.0;
  for (const double m : means) variance += (m - centre) * (m - centre) / (means.size() - 1);
  const double half = 1.96 * std::sqrt(variance / means.size());
  const auto interval = BootstrapInterval(flights, Mean);
  ASSERT_TRUE(interval.has_value());
  EXPECT_NEAR(interval->low, centre - half, 0.1 * half);
  EXPECT_NEAR(interval->high, centre + half, 0.1 * half);
}

TEST(Bootstrap, NeedsTwoFlights) {
  EXPECT_FALSE(BootstrapInterval({{1.0, 2.0}, {}}, Mean).has_value());
  EXPECT_TRUE(BootstrapInterval({{1.0}, {2.0}}, Mean).has_value());
}

TEST(TimeInside, IsTheTimeFromWhichOnErrorsStaySmall) {
  const std::vector<TimedError> errors = {{1, 0.1}, {2, -0.9}, {3, 0.2}, {4, -0.3}};
  EXPECT_EQ(TimeInside(errors, 0.3), 3.0);
  EXPECT_EQ(TimeInside(errors, 1.0), 1.0);
  EXPECT_TRUE(std::isnan(TimeInside(errors, 0.25)));
  EXPECT_TRUE(std::isnan(TimeInside({}, 1.0)));
  EXPECT_TRUE(std::isnan(TimeInside({{1, std::nan("")}}, 1.0)));
}

WindowEstimate WindowAt(int seconds, double b_az) {
  WindowEstimate window;
  window.end = FromSeconds(seconds);
  window.parameters = {{"b_az", b_az, 0.1, "m/s^2", "identified"}};
  return window;
}

TEST(Convergence, TakesParametersWithKnownTruthAndTimesFromTheFirstFix) {
  const EstimatorRun run{"vgd", 3, {WindowAt(4, 0.5), WindowAt(8, 0.22), WindowAt(12, 0.2)}, {}};
  const auto rows =
      Convergence(run, "VGD", {{"b_az", 0.2}},
                  {{"b_az", 0.05}, {"b_ax", 0.1}, {"final_point_error", 1.0}}, FromSeconds(2));
  ASSERT_EQ(rows.size(), 1U);  // no b_ax, no arcs
  EXPECT_EQ(rows[0].quantity, "b_az");
  EXPECT_NEAR(rows[0].time, 6.0, 1e-9);
}

ArcRow Arc(const std::string& label, double error, bool inside, bool counted) {
  ArcRow arc;
  arc.label = label;
  arc.estimator = "vgd";
  arc.gamma = 3;
  arc.error = error;
  arc.inside_95 = inside;
  arc.counted = counted;
  arc.iterations = 4;
  arc.bound = 0.5;
  return arc;
}

TEST(Summary, PoolsSeedsAndLeavesOutWhatDoesNotCount) {
  std::vector<JobOutcome> outcomes(2);
  outcomes[0].job.log = outcomes[1].job.log = "oval";
  outcomes[0].result.arcs = {Arc("A", 3.0, true, true), Arc("A", 4.0, false, true),
                             Arc("B", 9.0, true, true), Arc("A", 99.0, false, false)};
  outcomes[1].result.arcs = {Arc("A", 5.0, true, true), Arc("A", INFINITY, false, true)};
  const auto groups = SummariseGroups(outcomes);
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_EQ(groups[0].label, "A");
  EXPECT_EQ(groups[0].flights, 2);
  EXPECT_EQ(groups[0].error.count, 3);
  EXPECT_EQ(groups[0].diverged, 1);
  EXPECT_DOUBLE_EQ(groups[0].error.mean, 4.0);
  EXPECT_DOUBLE_EQ(groups[0].error.median, 4.0);
  EXPECT_DOUBLE_EQ(groups[0].rms, std::sqrt(50.0 / 3.0));
  EXPECT_DOUBLE_EQ(groups[0].bound_rms, 0.5);
  EXPECT_EQ(groups[0].inside_95, 2);
  EXPECT_EQ(groups[1].flights, 1);
  EXPECT_FALSE(groups[1].mean_interval.has_value());
}

TEST(Summary, MedianTimeIsInfiniteWhereMostFlightsNeverConverge) {
  std::vector<JobOutcome> outcomes(3);
  const double never = std::nan("");
  outcomes[0].result.convergence = {{"A", 3, "b_az", 0.1, 9, 4.0}, {"B", 3, "b_az", 0.1, 9, 8.0}};
  outcomes[1].result.convergence = {{"A", 3, "b_az", 0.1, 9, never}, {"B", 3, "b_az", 0.1, 9, 6.0}};
  outcomes[2].result.convergence = {{"A", 3, "b_az", 0.1, 9, never},
                                    {"B", 3, "b_az", 0.1, 9, never}};
  const auto times = SummariseConvergence(outcomes);
  ASSERT_EQ(times.size(), 2U);
  EXPECT_EQ(times[0].converged, 1);
  EXPECT_TRUE(std::isinf(times[0].median_time));
  EXPECT_EQ(times[1].converged, 2);
  EXPECT_EQ(times[1].median_time, 8.0);
}

}  // namespace
}  // namespace trueline
