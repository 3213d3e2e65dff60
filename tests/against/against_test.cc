// trueline-diagnose --against on made flights: trims with noise, sessions that differ.
#include <cmath>

#include "problems/against/comparison.h"
#include "problems/common/random.h"
#include "problems/result/statistics.h"
#include "tests/common/test_files.h"

namespace trueline {
namespace {

constexpr double kWithin = 0.006, kBetween = 0.025;  // of ln(command)

// A flight of 20 s: 2 s at rest, a climb to 1 m, hover with noise, and the end in the air.
FlightLog MadeFlight(const Eigen::Vector4d& trim, Random* random) {
  FlightLog log;
  log.directory = "made";
  constexpr double kRate = 50.0, kRest = 2.0, kClimb = 2.0, kHeight = 1.0, kNoise = 0.02;
  for (int i = 0; i < static_cast<int>(20.0 * kRate); ++i) {
    const double t = i / kRate;
    const double height = kHeight * std::clamp((t - kRest) / kClimb, 0.0, 1.0);
    log.fixes.push_back({FromSeconds(t), {0.0, 0.0, -height}, 0.01, -1});
    ChannelsSample sample{FromSeconds(t), {}};
    for (const double u : trim) {
      sample.values.push_back(t < kRest ? 0.0 : std::min(1.0, u + kNoise * random->Normal()));
    }
    log.motors.push_back(sample);
    log.battery.push_back({FromSeconds(t), 3.7});
  }
  return log;
}

class Fleet {
 public:
  explicit Fleet(std::uint64_t seed) : random_(seed, "against") {}

  // The trim of a session about that of the vehicle.
  Eigen::Vector4d Session() { return Scattered(Eigen::Vector4d(0.60, 0.55, 0.65, 0.58), kBetween); }
  CommandTrim Flight(const Eigen::Vector4d& session) {
    return TrimOf(MadeFlight(Scattered(session, kWithin), &random_));
  }
  std::vector<ReferenceFlight> References(int sessions, int flights_of_each) {
    std::vector<ReferenceFlight> flights;
    for (int s = 0; s < sessions; ++s) {
      const Eigen::Vector4d session = Session();
      for (int i = 0; i < flights_of_each; ++i) flights.push_back({Flight(session), s});
    }
    return flights;
  }

 private:
  Eigen::Vector4d Scattered(Eigen::Vector4d trim, double sigma) {
    for (double& u : trim) u *= std::exp(sigma * random_.Normal());
    return trim;
  }

  Random random_;
};

std::vector<int> Named(const Comparison& comparison) {
  const Findings& findings = comparison.findings;
  return findings.named ? findings.named->channels : std::vector<int>{};
}

Eigen::Vector4d Weakened(Eigen::Vector4d trim, const std::vector<std::pair<int, double>>& factors) {
  for (const auto& [rotor, factor] : factors) trim[rotor] /= factor;
  return trim;
}

TEST(Against, NamesTheWeakRotorAndItsFactor) {
  int covered = 0, alone = 0;
  constexpr int kFlights = 40;
  for (int seed = 0; seed < kFlights; ++seed) {
    Fleet fleet(static_cast<std::uint64_t>(seed));
    const auto references = fleet.References(4, 3);
    const int rotor = seed % 4;
    const auto flight = fleet.Flight(Weakened(fleet.Session(), {{rotor, 0.8}}));
    const Comparison found = Compare(flight, references, SessionOfFlight::kUnknown);
    ASSERT_TRUE(found.findings.named) << "seed " << seed;
    EXPECT_EQ(Named(found).front(), rotor) << "seed " << seed;
    alone += Named(found).size() == 1 ? 1 : 0;
    const TriedCause& cause = found.findings.tried.front();
    if (std::abs(cause.size[0] + std::log(0.8)) < 1.96 * cause.sigma[0]) ++covered;
  }
  EXPECT_GE(alone, 36);    // a second rotor is added by chance in 5 %
  EXPECT_GE(covered, 34);  // 95 % of 40, less three sigmas
}

TEST(Against, NamesTwoRotors) {
  for (int seed = 0; seed < 20; ++seed) {
    Fleet fleet(static_cast<std::uint64_t>(100 + seed));
    const auto references = fleet.References(4, 3);
    const auto flight = fleet.Flight(Weakened(fleet.Session(), {{0, 0.75}, {1, 0.78}}));
    const Comparison found = Compare(flight, references, SessionOfFlight::kUnknown);
    EXPECT_THAT(Named(found), UnorderedElementsAre(0, 1)) << "seed " << seed;
  }
}

TEST(Against, NamesNothingOnFlightsOfOtherSessions) {
  int named = 0;
  for (int seed = 0; seed < 200; ++seed) {
    Fleet fleet(static_cast<std::uint64_t>(200 + seed));
    const auto references = fleet.References(1 + seed % 4, 1 + seed % 3);
    const auto flight = fleet.Flight(fleet.Session());
    named +=
        Compare(flight, references, SessionOfFlight::kUnknown).findings.named.has_value() ? 1 : 0;
  }
  EXPECT_LE(named, 2);
}

TEST(Against, AScatterKnownByFewFlightsHasTails) {
  int named = 0;
  const UsualScatter narrow = {{0.004, 0.005}, {0.01, 0.012}};  // half of the vehicle's
  for (int seed = 0; seed < 200; ++seed) {
    Fleet fleet(static_cast<std::uint64_t>(700 + seed));
    const auto references = fleet.References(4, 2);
    const auto flight = fleet.Flight(fleet.Session());
    const Comparison found = Compare(flight, references, SessionOfFlight::kUnknown, {narrow});
    named += found.findings.named ? 1 : 0;
    EXPECT_EQ(found.findings.named.has_value(),
              found.findings.tried.front().evidence > found.EvidenceNeeded());
  }
  EXPECT_LE(named, 4);
}

TEST(Against, SeesSmallLossesWithinASession) {
  int named = 0, right = 0;
  for (int seed = 0; seed < 40; ++seed) {
    Fleet fleet(static_cast<std::uint64_t>(500 + seed));
    const Eigen::Vector4d session = fleet.Session();
    std::vector<ReferenceFlight> references;
    for (int i = 0; i < 4; ++i) references.push_back({fleet.Flight(session)});
    const auto same = SessionOfFlight::kSame;
    named += Compare(fleet.Flight(session), references, same).findings.named.has_value() ? 1 : 0;
    const auto weak = fleet.Flight(Weakened(session, {{2, 0.95}}));
    right += Named(Compare(weak, references, same)) == std::vector<int>{2} ? 1 : 0;
    EXPECT_THAT(Named(Compare(weak, references, SessionOfFlight::kUnknown)), IsEmpty());
  }
  EXPECT_LE(named, 1);
  EXPECT_GE(right, 36);
}

TEST(Against, TheThrustOfAllIsAScaleOrAMass) {
  Fleet fleet(7);
  auto references = fleet.References(3, 3);
  auto flight = fleet.Flight(fleet.Session() / 1.3);
  const Comparison found = Compare(flight, references, SessionOfFlight::kUnknown);
  ASSERT_TRUE(found.findings.named);
  const TriedCause& cause = found.findings.tried.front();
  EXPECT_EQ(cause.id, "thrust_scale");
  EXPECT_NEAR(std::exp(-cause.size[0]), 1.3, 0.1);
  EXPECT_NEAR(found.LoadOf(cause).share, 1.0 / 1.3 - 1.0, 0.1);  // lighter
  // Where all logs state a mass, the command is compared by mass.
  for (ReferenceFlight& reference : references) reference.trim.mass = 0.1;
  flight.mass = 0.1 / 1.3;
  EXPECT_FALSE(Compare(flight, references, SessionOfFlight::kUnknown).findings.named);
}

// Throttle that no firmware corrects: a thrust needs a command that goes with 1 / voltage^2.
CommandTrim OnBattery(CommandTrim trim, double voltage) {
  constexpr double kFresh = 16.4;  // V
  trim.command *= std::pow(kFresh / voltage, 2);
  trim.voltage = voltage;
  return trim;
}

TEST(Against, ALowBatteryIsNoWeakMotor) {
  Fleet fleet(31);
  std::vector<ReferenceFlight> references = fleet.References(3, 3);
  for (ReferenceFlight& reference : references) reference.trim = OnBattery(reference.trim, 16.4);
  const CommandTrim low = OnBattery(fleet.Flight(fleet.Session()), 14.5);
  EXPECT_FALSE(Compare(low, references, SessionOfFlight::kUnknown).findings.named);
}

TEST(Against, LearnsWhatTheBatteryDoes) {
  Fleet fleet(32);
  std::vector<ReferenceFlight> references = fleet.References(4, 3);
  double voltage = 16.6;
  for (ReferenceFlight& reference : references) {
    voltage = voltage < 15.2 ? 16.6 : voltage - 0.5;
    reference.trim = OnBattery(reference.trim, voltage);
  }
  const References learned = LearnFrom(references, false);
  EXPECT_NEAR(learned.slope, -2.0, 3.0 * learned.slope_sigma);
  EXPECT_LT(learned.slope_sigma, 0.1);
  const CommandTrim weak = OnBattery(fleet.Flight(fleet.Session() / 0.8), 14.5);
  const Comparison found = Compare(weak, references, SessionOfFlight::kUnknown);
  ASSERT_TRUE(found.findings.named);
  EXPECT_EQ(found.findings.named->id, "thrust_scale");
}

TEST(Against, AFullCommandIsABound) {
  Random random(3, "full");
  std::vector<double> values;
  for (int i = 0; i < 20000; ++i) values.push_back(std::min(1.0, 0.97 + 0.05 * random.Normal()));
  EXPECT_LT(Mean(values), 0.963);
  EXPECT_NEAR(CensoredMean(values, 1.0), 0.97, 0.002);
}

TEST(Against, LearnsTheScatterOfManySessions) {
  Fleet fleet(11);
  const References learned = LearnFrom(fleet.References(60, 4), false);
  EXPECT_EQ(learned.sessions(), 60);
  EXPECT_NEAR(learned.between.OfOneChannel(), kBetween, 0.004);
  EXPECT_NEAR(learned.within.OfOneChannel(), kWithin, 0.002);
  EXPECT_FALSE(learned.between_is_usual);
}

TEST(Against, FindsSessionsByTheTrims) {
  Fleet fleet(12);
  const Eigen::Vector4d one = fleet.Session();
  std::vector<ReferenceFlight> flights;
  for (int i = 0; i < 6; ++i) flights.push_back({fleet.Flight(i < 3 ? one : 1.1 * one)});
  EXPECT_THAT(LearnFrom(flights, false).session_of, ElementsAre(0, 0, 0, 1, 1, 1));
}

TEST(Against, SaysWhatIsAlike) {
  const TestFolder folder;
  Fleet fleet(13);
  const auto references = fleet.References(1, 3);
  const auto flight = fleet.Flight(Weakened(fleet.Session(), {{2, 0.7}}));
  const Comparison found = Compare(flight, references, SessionOfFlight::kUnknown);
  WriteComparison(found, YAML::Node(), folder.directory());
  const YAML::Node result = YAML::LoadFile(folder / "diagnosis.yaml");
  EXPECT_EQ(result["verdict"].as<std::string>(), "ambiguous");
  ASSERT_EQ(result["causes"].size(), 1U);
  const YAML::Node cause = result["causes"][0];
  EXPECT_EQ(cause["id"].as<std::string>(), "rotor_loss");
  EXPECT_EQ(cause["parameters"]["rotor"]["value"].as<int>(), 2);
  EXPECT_EQ(cause["confused_with"][0].as<std::string>(), "payload");
  EXPECT_GT(cause["alternatives"][0]["parameters"]["share_of_mass"]["value"].as<double>(), 0.05);
  EXPECT_THAT(result["references"]["text"].as<std::string>(), HasSubstr("one session"));
  EXPECT_EQ(result["against"].size(), 3U);
}

// A vehicle that turns by its commands through a motor lag and a delay, by its air speed, and by
// what no log shows. Gyroscope at `rate`.
FlightLog TurningFlight(double rate, std::uint64_t seed) {
  constexpr double kLag = 0.05, kDelay = 0.02, kStep = 0.001;  // s
  const Eigen::Matrix<double, 3, 4> turn = (Eigen::Matrix<double, 3, 4>() << -90.0, -90.0, 90.0,
                                            90.0, 90.0, -90.0, -90.0, 90.0, 9.0, -9.0, 9.0, -9.0)
                                               .finished();  // rad/s^2 at full command
  Random random(seed, "turning");
  FlightLog log;
  Eigen::Vector3d w = Eigen::Vector3d::Zero(), eddy = w;
  Eigen::Vector4d speed = Eigen::Vector4d::Constant(std::sqrt(0.6));
  std::vector<Eigen::Vector4d> commands;
  for (int i = 0; i < 20000; ++i) {
    const double t = kStep * i;
    const TimeNs now = FromSeconds(t);
    // A course along x, so that the air speed is known; attitude plays no part in what is tested.
    const double x = 2.0 * std::sin(t), v = 2.0 * std::cos(t);
    if (i % 10 == 0) {
      Eigen::Vector4d u = Eigen::Vector4d::Constant(0.6);
      for (double& one : u) one += 0.03 * random.Normal();
      u += 0.1 * (turn.transpose() * -w).cwiseMax(-1.0).cwiseMin(1.0);
      commands.push_back(u);
      log.motors.push_back({now, {u[0], u[1], u[2], u[3]}});
      log.mocap.push_back({now, {x, 0.0, -1.0}, Eigen::Quaterniond::Identity()});
    }
    const int acting = std::max(0, (i - static_cast<int>(kDelay / kStep)) / 10);
    speed += kStep / kLag * (commands[acting].cwiseMax(0.0).cwiseSqrt() - speed);
    if (i % 20 == 0) eddy = 6.0 * random.NormalVector3();
    w += kStep * (turn * speed.cwiseAbs2() + Eigen::Vector3d(0.0, -4.0 * v, 0.0) + eddy);
    if (i % static_cast<int>(1.0 / (rate * kStep)) == 0) {
      log.imu.push_back({now, {0.0, 0.0, -9.81}, w + 0.005 * random.NormalVector3()});
    }
  }
  return log;
}

TEST(Against, CommandsExplainTheTurnsOfAnotherFlight) {
  for (const double rate : {100.0, 500.0}) {
    const FlightLog first = TurningFlight(rate, 1), second = TurningFlight(rate, 2);
    const auto response = ResponseOf(second, {&first});
    ASSERT_TRUE(response);
    EXPECT_NEAR(response->delay, 0.02, 0.0101);
    EXPECT_NEAR(response->lag, 0.05, 0.0301);
    EXPECT_GT(response->explained[0], 0.6);
    EXPECT_LT(response->explained[0], 0.97);  // of the eddies no command knows
    EXPECT_GT(response->explained[1], 0.6);
    // Commands of another flight explain nothing.
    FlightLog mixed = second;
    mixed.motors = TurningFlight(rate, 3).motors;
    EXPECT_LT(ResponseOf(mixed, {&first})->explained[0], 0.1);
  }
  FlightLog silent = TurningFlight(100.0, 4);
  silent.mocap.clear();
  EXPECT_FALSE(ResponseOf(silent, {&silent}));
}

TEST(Against, RefusesWhatCanNotBeCompared) {
  Fleet fleet(14);
  const CommandTrim flight = fleet.Flight(fleet.Session());
  const auto unknown = SessionOfFlight::kUnknown;
  CommandTrim total = flight;
  total.command = total.command.head(1).eval();
  EXPECT_THAT(ErrorOf([&] { Compare(flight, {{total}}, unknown); }), HasSubstr("has 4 commands"));
  Random random(1, "short");
  FlightLog log = MadeFlight(Eigen::Vector4d::Constant(0.6), &random);
  log.motors.resize(300);  // 6 s, of which 2 s hover
  EXPECT_THAT(ErrorOf([&] { TrimOf(log); }), HasSubstr("steady flight"));
  log.motors.clear();
  EXPECT_THAT(ErrorOf([&] { TrimOf(log); }), HasSubstr("neither motors.csv nor rotors.csv"));
}

}  // namespace
}  // namespace trueline
