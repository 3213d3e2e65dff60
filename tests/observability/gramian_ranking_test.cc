// Flights ranked by the E2LOG Gramian.
#include "problems/observability/gramian_ranking.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "problems/common/error.h"
#include "problems/log/native_log.h"
#include "tests/common/test_files.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;
const fs::path kObserve = TRUELINE_TEST_SOURCE_DIR "/config/observe";

RotorFlight Figure(double duration) {
  const Lissajous figure{{0.4, 0.4, 0.15, 1.0}, {0.5, 0.6, 0.7, 0.4}, {0, 1.571, 1.047, 0}};
  return {{TestQuadrotor(), TestNominal()}, LissajousPath(figure, duration)};
}

double Distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const Eigen::VectorXd unit = b.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  return (unit.asDiagonal() * (a - b) * unit.asDiagonal()).cwiseAbs().maxCoeff();
}

TEST(E2logOfARecordedFlight, IsThatOfItsTrajectory) {
  const RotorDrivenSystem system(TestQuadrotor(), OnlySensors(true, false, true));
  const RotorFlight flight = Figure(3.0);
  E2logOptions options;
  options.order = 4;
  const auto exact = E2log(system, flight, system.OutputWeights(), options);
  const auto recorded = E2log(system, flight.Nominal(), system.OutputWeights(), options);
  EXPECT_LT(Distance(recorded, exact), 0.01);
}

TEST(E2log, SummedIsTheSumOfItsPartsAndChainedIsNot) {
  const RotorDrivenSystem system(TestQuadrotor(), OnlySensors(true, false, true));
  const RotorFlight flight = Figure(0.2);
  NominalFlight first = flight.Nominal(), second = first;
  first.end = second.start = 0.1;
  E2logOptions options;
  options.chained = false;
  const auto of = [&](const NominalFlight& f) {
    return E2log(system, f, system.OutputWeights(), options);
  };
  const Eigen::MatrixXd sum = of(first) + of(second);
  EXPECT_LT(Distance(of(flight.Nominal()), sum), 1e-9);
  options.chained = true;
  EXPECT_GT(Distance(of(flight.Nominal()), sum), 1e-3);
}

Ranking RankText(const std::string& e2log, const std::string& cases) {
  const YAML::Node file = YAML::LoadFile((kObserve / "e2log.yaml").string());
  YAML::Node config;
  config["vehicle"] = file["vehicle"];
  config["e2log"] = YAML::Load(e2log);
  config["cases"] = YAML::Load(cases);
  return RankByE2log({YamlMap(config, "test.yaml", ""), {}, {}}, nullptr);
}

// A simulated flight whose streams have their own rates, as a native log.
fs::path MadeLog(const TestFolder& folder) {
  RotorSimulation simulation(WuestVehicle());
  simulation.imu_rate = 100.0;
  simulation.pose_rate = 10.0;
  WriteNativeLog(SimulateRotorFlight(simulation, RandomPath(4.0, 1), 1), folder / "log");
  return folder / "log";
}

RankedFlight RankLog(const fs::path& log, const std::string& sensors) {
  YAML::Node config;
  config["vehicle"] = YAML::LoadFile((kObserve / "e2log.yaml").string())["vehicle"];
  config["e2log"] = YAML::Load("{scale: typical}");
  config["sensors"] = YAML::Load(sensors);
  return RankByE2log({YamlMap(config, "test.yaml", ""), {}, {log}}, nullptr).flights.at(0);
}

TEST(GramianRanking, ALogHasItsOwnRatesUnlessTheyAreStated) {
  const TestFolder folder;
  const fs::path log = MadeLog(folder);
  const RankedFlight own = RankLog(log, "{}"),
                     wuest = RankLog(log, "{imu_rate: 250, pose_rate: 30}"),
                     stated = RankLog(log, "{imu_rate: 100, pose_rate: 10}");
  for (std::size_t i = 0; i < own.sigma.size(); ++i) {
    EXPECT_NEAR(own.sigma[i] / stated.sigma[i], 1.0, 0.02);
    EXPECT_GT(own.sigma[i], 1.3 * wuest.sigma[i]);
  }
}

const char kCases[] =
    "[{name: hover, trajectory: {kind: hover, duration: 4}},"
    " {name: shuttle, trajectory: {kind: lissajous, duration: 4, amplitude: [0.4, 0, 0, 0],"
    "  frequency: [0.7, 0, 0, 0]}},"
    " {name: all axes, trajectory: {kind: lissajous, duration: 4, amplitude: [0.4, 0.4, 0.15, 1],"
    "  frequency: [0.5, 0.6, 0.7, 0.4]}}]";

TEST(GramianRanking, AConstantNamedTwiceIsOne) {
  const Ranking once = RankText("{scale: typical, show: [r_BP_x]}", kCases);
  const Ranking twice = RankText("{scale: typical, show: [r_BP_x, r_BP_x], free: [m, m]}", kCases);
  ASSERT_EQ(twice.shown.size(), 1U);
  EXPECT_EQ(twice.flights[0].scores.sigma_min, once.flights[0].scores.sigma_min);
}

TEST(GramianRanking, PutsWhatTurnsAboutAllAxesFirst) {
  for (const char* weighting : {"noise", "none"}) {
    const Ranking ranking =
        RankText(std::string("{scale: typical, weighting: ") + weighting + "}", kCases);
    ASSERT_EQ(ranking.flights.size(), 3U);
    EXPECT_EQ(ranking.flights[0].name, "all axes");
    EXPECT_GT(ranking.flights[0].scores.sigma_min, ranking.flights[1].scores.sigma_min);
    EXPECT_GE(ranking.flights[1].scores.sigma_min, ranking.flights[2].scores.sigma_min);
    const YAML::Node yaml = YAML::Load(RankingYaml(ranking, "test"));
    EXPECT_EQ(yaml["flights"][0]["name"].as<std::string>(), "all axes");
    EXPECT_NEAR(yaml["flights"][0]["crlb"]["r_BP_x"]["value"].as<double>(),
                ranking.flights[0].sigma[0], 1e-3 * ranking.flights[0].sigma[0]);
  }
}

const RankedFlight& Named(const Ranking& ranking, const std::string& name) {
  for (const RankedFlight& flight : ranking.flights) {
    if (flight.name == name) return flight;
  }
  throw std::out_of_range(name);
}

// Other states as known can only add to the score; bounds do not depend on how a flight is scored.
TEST(GramianRanking, KnownStatesRaiseTheScoreAndLeaveTheBound) {
  const Ranking unknown = RankText("{scale: typical}", kCases);
  const Ranking known = RankText("{scale: typical, others: known}", kCases);
  for (const RankedFlight& flight : known.flights) {
    const RankedFlight& same = Named(unknown, flight.name);
    EXPECT_GE(flight.scores.sigma_min, same.scores.sigma_min) << flight.name;
    EXPECT_EQ(flight.sigma, same.sigma) << flight.name;
  }
  EXPECT_GT(Named(known, "all axes").scores.sigma_min,
            2.0 * Named(unknown, "all axes").scores.sigma_min);
}

TEST(GramianRanking, TheDeviationOfEstimatesScalesTheColumns) {
  const Ranking ranking = RankText("{scale: deviation, scale_flights: 3, show: [r_BP_x]}", kCases);
  ASSERT_EQ(ranking.scale.size(), 1U);
  EXPECT_GT(ranking.scale[0], 1e-4);  // m
  EXPECT_LT(ranking.scale[0], 0.1);
  const Ranking typical = RankText("{scale: typical, show: [r_BP_x]}", kCases);
  const double ratio = ranking.scale[0] / typical.scale[0];
  EXPECT_NEAR(ranking.flights[0].scores.sigma_min,
              ratio * ratio * typical.flights[0].scores.sigma_min,
              1e-6 * ranking.flights[0].scores.sigma_min);
}

TEST(GramianRanking, RefusesWhatItCannotScore) {
  EXPECT_THROW(RankText("{scale: typical, show: [p_x]}", kCases), InputError);
  EXPECT_THROW(RankText("{order: 7}", kCases), InputError);
  EXPECT_THROW(RankText("{scale: typical}", "[]"), InputError);
  EXPECT_THROW(RankByE2log({std::nullopt, {"no.yaml"}, {}}, nullptr), InputError);
}

}  // namespace
}  // namespace trueline
