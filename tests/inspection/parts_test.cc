// The parts of an inspection on made signals whose answers are known.
#include <cmath>
#include <numbers>
#include <random>

#include "problems/inspection/excerpt.h"
#include "problems/inspection/motion.h"
#include "problems/inspection/stream_health.h"
#include "problems/inspection/vector_match.h"
#include "tests/common/matchers.h"

namespace trueline {
namespace {

// A vector that moves about all axes, in m/s or whatever.
Eigen::Vector3d Moving(double t) {
  return {std::sin(1.3 * t) + 0.3 * std::cos(4.1 * t), std::cos(0.7 * t) - 0.4 * std::sin(3.3 * t),
          0.8 * std::sin(2.1 * t + 0.5)};
}

PairsAt Pairs(const Eigen::Matrix3d& turn, double gain, double late, double noise) {
  return [=](double lag) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal(0.0, noise);
    std::vector<VectorPair> pairs;
    for (double t = 0.0; t < 30.0; t += 0.02) {
      const Eigen::Vector3d error(normal(random), normal(random), normal(random));
      pairs.push_back({t, gain * (turn * Moving(t - late)) + error, Moving(t - lag)});
    }
    return pairs;
  };
}

// A line of slope 2 that starts at 1, with samples that lie on no point of the grid.
TEST(RunningIntegral, IsThatOfStraightLinesAndKnowsGaps) {
  RunningIntegral<1> once(0.01, 0.1);
  const auto add = [&](double from, double to) {
    for (double t = from; t < to; t += 0.0137)
      once.Add(t, Eigen::Matrix<double, 1, 1>(1.0 + 2.0 * t));
  };
  add(0.0, 2.0);
  add(3.0, 5.0);
  EXPECT_NEAR(once.Mean(0.31, 1.27)[0], 1.0 + 0.31 + 1.27, 1e-9);
  EXPECT_NEAR(once.Mean(3.31, 4.27)[0], 1.0 + 3.31 + 4.27, 1e-9);
  EXPECT_TRUE(once.Knows(0.1, 1.9));
  EXPECT_FALSE(once.Knows(1.9, 3.1));
  EXPECT_FALSE(once.Knows(4.0, 5.1));
  const RunningIntegral<1> twice = std::move(once).Integrated();
  const auto exact = [](double t) { return 0.5 * t * t + t * t * t / 3.0; };
  EXPECT_NEAR(twice.At(1.5)[0], exact(1.5), 1e-3);
}

TEST(VectorMatch, FindsTurnGainAndLag) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.9, Eigen::Vector3d(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
  const auto match = MatchVectors(Pairs(turn, 1.1, 0.137, 0.1), {});
  ASSERT_TRUE(match.has_value());
  EXPECT_NEAR(match->lag, 0.137, std::max(5.0 * match->lag_sigma, 0.001));
  EXPECT_LT(match->lag_sigma, 0.005);
  EXPECT_LT(TurnBetween(match->turn, turn).norm(), 0.02);
  EXPECT_NEAR(match->gain, 1.1, 0.03);
  EXPECT_TRUE(PlainTurn(*match, 0.08).isApprox(match->turn));
}

TEST(VectorMatch, KnowsAMirror) {
  const Eigen::Matrix3d mirror = Eigen::Vector3d(1.0, -1.0, 1.0).asDiagonal();
  const auto match = MatchVectors(Pairs(mirror, 1.0, 0.0, 0.1), {});
  ASSERT_TRUE(match.has_value());
  EXPECT_LT(match->reflection, -5.0);
  EXPECT_EQ(PlainTurn(*match, 0.08), mirror);
}

// A motion in a plane shows neither the handedness nor a turn that it does not see.
TEST(VectorMatch, StatesNoMirrorThatAPlaneDoesNotShow) {
  const PairsAt all = Pairs(Eigen::Matrix3d::Identity(), 1.0, 0.0, 0.05);
  const auto match = MatchVectors(
      [&](double lag) {
        auto pairs = all(lag);
        for (VectorPair& pair : pairs) pair.sure.z() = 0.0;
        return pairs;
      },
      {});
  ASSERT_TRUE(match.has_value());
  EXPECT_GT(match->turn.determinant(), 0.0);
  EXPECT_EQ(PlainTurn(*match, 0.08), Eigen::Matrix3d::Identity());
}

// Sixty seconds whose lag is `lag` in the middle and grows by `drift`.
PairsAt Drifting(double middle, double drift, double noise) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, noise);
  std::vector<VectorPair> seen;
  for (double t = 0.0; t < 60.0; t += 0.05) {
    const Eigen::Vector3d error(normal(random), normal(random), normal(random));
    seen.push_back({t, Moving(t - middle - drift * (t - 30.0)) + error, {}});
  }
  return [seen](double lag) {
    std::vector<VectorPair> pairs = seen;
    for (VectorPair& pair : pairs) pair.sure = Moving(pair.t - lag);
    return pairs;
  };
}

TEST(VectorMatch, FindsADriftingClock) {
  const auto match = MatchVectors(Drifting(0.015, 5e-4, 0.0), {});
  ASSERT_TRUE(match.has_value());
  EXPECT_NEAR(match->drift, 5e-4, 5e-5);
}

// Blocks of such a flight lie farther apart than a fine search about one lag sees.
TEST(VectorMatch, FindsAClockThatDriftsFar) {
  for (const double drift : {1.2e-3, 2e-3, -3e-3, 5e-3, -8e-3}) {
    const auto match = MatchVectors(Drifting(0.3, drift, 0.1), {});
    ASSERT_TRUE(match.has_value()) << drift;
    EXPECT_NEAR(match->drift, drift, 0.05 * std::abs(drift)) << drift;
    EXPECT_LT(match->drift_sigma, 0.1 * std::abs(drift)) << drift;
    EXPECT_NEAR(match->lag, 0.3, 0.01) << drift;
    EXPECT_GT(match->correlation, 0.9) << drift;
    EXPECT_EQ(PlainTurn(*match, 0.05), Eigen::Matrix3d::Identity()) << drift;
  }
}

// Noise scatters the blocks' lags; that is no drift.
TEST(VectorMatch, StatesNoDriftThatIsNotThere) {
  for (const double noise : {0.0, 0.3, 1.0, 2.0}) {
    const auto match = MatchVectors(Drifting(0.1, 0.0, noise), {});
    ASSERT_TRUE(match.has_value()) << noise;
    const bool stated = std::abs(match->drift) > std::max(1e-4, 5.0 * match->drift_sigma);
    EXPECT_FALSE(stated) << noise << ": " << match->drift;
  }
}

TEST(Spectrum, StatesTheDensityOfWhiteNoiseAndItsFilter) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, 0.2);
  std::vector<double> white, filtered;
  double first = 0.0, second = 0.0, third = 0.0;
  for (int i = 0; i < 50000; ++i) {
    white.push_back(normal(random));
    first += 0.2 * (white.back() - first);
    second += 0.2 * (first - second);
    third += 0.2 * (second - third);
    filtered.push_back(third);
  }
  const Noise noise = NoiseOf(WelchSpectrum(white, 400.0), 1e-3);
  EXPECT_NEAR(noise.density, 0.2 / std::sqrt(200.0), 0.001);
  EXPECT_EQ(noise.cutoff, 0.0);
  EXPECT_EQ(noise.peak, 0.0);
  const double cutoff = NoiseOf(WelchSpectrum(filtered, 400.0), 1e-3).cutoff;
  EXPECT_GT(cutoff, 10.0);
  EXPECT_LT(cutoff, 60.0);
}

TEST(Spectrum, FindsALine) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, 0.2);
  std::vector<double> values;
  for (int i = 0; i < 20000; ++i) {
    values.push_back(normal(random) + std::sin(2.0 * std::numbers::pi * 87.0 * i / 400.0));
  }
  EXPECT_NEAR(NoiseOf(WelchSpectrum(values, 400.0), 1e-3).peak, 87.0, 1.0);
}

TEST(StreamHealth, NamesGapsRepeatsAndSpikes) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, 0.05);
  FlightLog log;
  for (int i = 0; i < 3000; ++i) {
    const double t = 0.01 * i + (i > 1000 ? 0.5 : 0.0);
    ImuSample sample{FromSeconds(t), {0.0, 0.0, -9.81}, {0.0, 0.0, 0.0}};
    for (int k = 0; k < 3; ++k) sample.accel[k] += normal(random);
    log.imu.push_back(sample);
    log.mocap.push_back(
        {sample.t, {std::floor(i / 3.0), 0.0, 0.0}, Eigen::Quaterniond::Identity()});
  }
  log.imu[2000].accel.x() = 60.0;
  std::vector<Finding> findings;
  const auto streams = CheckStreams(log, std::nullopt, &findings);
  ASSERT_EQ(streams.size(), 2U);
  EXPECT_EQ(streams[0].gaps, 1);
  EXPECT_NEAR(streams[0].longest, 0.51, 1e-6);
  EXPECT_NEAR(streams[1].repeats, 0.667, 0.01);
  std::vector<std::string> ids;
  for (const Finding& finding : findings)
    ids.push_back(finding.kind->id + (" of " + finding.stream));
  EXPECT_THAT(ids, UnorderedElementsAre("gaps of imu", "spikes of imu", "repeats of mocap"));
}

// Speeds (rad/s) of two rotors that change by 15 % within a quarter of a second.
FlightLog TwoRotors(double rate) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, 4.0);
  FlightLog log;
  for (double t = 0.0; t < 20.0; t += 1.0 / rate) {
    const double change = 120.0 * std::sin(12.0 * t) + 20.0 * std::sin(5.0 * t);
    log.rotors.push_back(
        {FromSeconds(t), {800.0 + change + normal(random), 800.0 - change + normal(random)}});
  }
  return log;
}

std::vector<std::string> NamesOfFindings(const FlightLog& log) {
  std::vector<Finding> findings;
  CheckStreams(log, std::nullopt, &findings);
  std::vector<std::string> names;
  for (const Finding& f : findings) {
    names.push_back(std::string(NameOf(f.level)) + " " + f.kind->id + " of " + f.stream);
  }
  return names;
}

TEST(StreamHealth, FindsSingleSamplesOfRotors) {
  EXPECT_THAT(NamesOfFindings(TwoRotors(250.0)), IsEmpty());
  for (const double wrong : {0.0, 6e4, 300.0}) {
    FlightLog log = TwoRotors(250.0);
    for (std::size_t i = 7; i < log.rotors.size(); i += 500) log.rotors[i].values[1] = wrong;
    EXPECT_THAT(NamesOfFindings(log), ElementsAre("biases spikes of rotors")) << wrong;
  }
}

TEST(StreamHealth, FindsGapsOfRotors) {
  FlightLog log = TwoRotors(250.0), brief = log;
  log.rotors.erase(log.rotors.begin() + 2000, log.rotors.begin() + 2250);
  EXPECT_THAT(NamesOfFindings(log), ElementsAre("biases gaps of rotors"));
  brief.rotors.erase(brief.rotors.begin() + 2000, brief.rotors.begin() + 2008);
  EXPECT_THAT(NamesOfFindings(brief), IsEmpty());
}

TEST(StreamHealth, FindsRotorsThatAreTooSlow) {
  EXPECT_THAT(NamesOfFindings(TwoRotors(50.0)), IsEmpty());
  EXPECT_THAT(NamesOfFindings(TwoRotors(10.0)), ElementsAre("biases rotors_slow of rotors"));
}

TEST(Excerpt, HoldsEveryStreamBetweenTheStamps) {
  FlightLog log;
  std::size_t streams = 0;
  ForEachStream(log, [&](const Stream&, auto& samples) {
    samples.resize(4);
    for (std::size_t i = 0; i < 4; ++i) samples[i].t = FromSeconds(static_cast<double>(i));
    ++streams;
  });
  const FlightLog part = PartOf(log, FromSeconds(1.0), FromSeconds(2.0));
  ForEachStream(part, [&](const Stream& stream, const auto& samples) {
    ASSERT_EQ(samples.size(), 2U) << stream.name;
    EXPECT_EQ(samples.front().t, FromSeconds(1.0)) << stream.name;
    --streams;
  });
  EXPECT_EQ(streams, 0U);
}

}  // namespace
}  // namespace trueline
