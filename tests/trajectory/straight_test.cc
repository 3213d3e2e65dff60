// Straights of the paper's hippodrome: 3 m straights, half circles of 1.5 m, 1.8 m/s.
#include "problems/trajectory/straight.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "problems/common/random.h"
#include "problems/trajectory/mocap_path.h"
#include "tests/common/test_files.h"

namespace trueline {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kStraight = 3.0, kRadius = 1.5, kSpeed = 1.8;
constexpr double kLap = 2.0 * kStraight + 2.0 * kPi * kRadius;

// Position at length s; straights run north at y = 0 from x = 0 to 3, and south at y = 3.
Eigen::Vector3d Hippodrome(double s) {
  s = std::fmod(s, kLap);
  const bool back = s >= kLap / 2.0;
  if (back) s -= kLap / 2.0;
  Eigen::Vector3d p(s, 0.0, -1.5);
  if (s > kStraight) {
    const double angle = (s - kStraight) / kRadius;
    p = {kStraight + kRadius * std::sin(angle), kRadius * (1.0 - std::cos(angle)), -1.5};
  }
  return back ? Eigen::Vector3d(kStraight - p.x(), 2.0 * kRadius - p.y(), p.z()) : p;
}

std::vector<PoseSample> Fly(int laps, double noise, double rate = 120.0) {
  Random random(3);
  std::vector<PoseSample> mocap;
  // Starts and ends in the middle of a turn.
  for (int i = 0; i < laps * kLap / kSpeed * rate; ++i) {
    const Eigen::Vector3d p = Hippodrome(kLap / 2.0 - 2.0 + i * kSpeed / rate);
    mocap.push_back({FromSeconds(i / rate), p + noise * random.NormalVector3(),
                     Eigen::Quaterniond::Identity()});
  }
  return mocap;
}

void ExpectHippodrome(const std::vector<Straight>& straights, int laps, double tolerance) {
  ASSERT_EQ(straights.size(), static_cast<std::size_t>(2 * laps));
  for (std::size_t i = 0; i < straights.size(); ++i) {
    const Straight& s = straights[i];
    EXPECT_EQ(s.gate.id, static_cast<int>(i % 2));
    EXPECT_NEAR(SecondsBetween(s.from, s.to), kStraight / kSpeed, 2.0 * tolerance / kSpeed);
    // Gate 0 ends the straight that leads south, which is flown first.
    const bool south = s.gate.id == 0;
    const Eigen::Vector3d end = south ? Eigen::Vector3d(0, 3, -1.5) : Eigen::Vector3d(3, 0, -1.5);
    EXPECT_LT((s.gate.position - end).norm(), tolerance);
    EXPECT_NEAR(std::abs(std::remainder(s.gate.yaw - (south ? kPi : 0.0), 2.0 * kPi)), 0.0, 0.15);
  }
}

StraightBox AlongX() {
  StraightBox box;
  box.low.x() = 0.0;
  box.high.x() = kStraight;
  return box;
}

TEST(Straights, AreFoundByCurvature) {
  ExpectHippodrome(FindStraights(Fly(5, 0.0), {}, {}), 5, 0.25);
}

TEST(Straights, AreFoundInNoise) { ExpectHippodrome(FindStraights(Fly(5, 0.003), {}, {}), 5, 0.3); }

TEST(Straights, AreFoundInSlowMocap) {
  ExpectHippodrome(FindStraights(Fly(5, 0.001, 30.0), {}, {}), 5, 0.3);
}

TEST(Straights, AreTakenFromABox) {
  ExpectHippodrome(StraightsInBoxes(Fly(4, 0.0), {AlongX()}, {}), 4, 0.03);
}

TEST(Straights, OfABoxKeepToItsHeading) {
  StraightBox box = AlongX();
  box.heading = 0.0;
  const auto straights = StraightsInBoxes(Fly(4, 0.0), {box}, {});
  ASSERT_EQ(straights.size(), 4U);
  for (const Straight& s : straights) EXPECT_NEAR(s.gate.yaw, 0.0, 1e-6);
  EXPECT_EQ(GatesOf(straights).size(), 1U);
}

// Samples further apart than the window over which speed is measured.
TEST(Straights, AreTakenFromVerySlowMocap) {
  ExpectHippodrome(StraightsInBoxes(Fly(4, 0.0, 6.0), {AlongX()}, {}), 4, 0.4);
}

// With half axes of `a` along x and `b` along y.
std::vector<PoseSample> FlyEllipse(double a, double b, int count) {
  std::vector<PoseSample> mocap;
  for (int i = 0; i < count; ++i) {
    const double t = 0.01 * i;
    mocap.push_back(
        {FromSeconds(t), {a * std::cos(t), b * std::sin(t), -1.0}, Eigen::Quaterniond::Identity()});
  }
  return mocap;
}

// A circle has none, unless the flattest part is asked for.
TEST(Straights, DontExistOnACircle) {
  EXPECT_TRUE(FindStraights(FlyEllipse(1.5, 1.5, 1200), {}, {}).empty());
}

// An ellipse bends everywhere; its long sides are the flattest 40 %.
TEST(Straights, CanBeTheFlattestShare) {
  const std::vector<PoseSample> mocap = FlyEllipse(2.0, 1.0, 3000);
  CurvatureOptions options;
  options.flattest_share = 0.4;
  const auto straights = FindStraights(mocap, options, {});
  ASSERT_GE(straights.size(), 8U);
  const auto gates = GatesOf(straights);
  ASSERT_EQ(gates.size(), 2U);
  for (const Gate& gate : gates) EXPECT_NEAR(std::abs(gate.position.y()), 0.9, 0.12);
}

TEST(Straights, EndWhereMocapHasAGap) {
  std::vector<PoseSample> mocap = Fly(1, 0.0);
  const auto cut = [](const PoseSample& p) {
    return p.p_E.y() < 0.01 && std::abs(p.p_E.x() - 1) < 0.4;
  };
  mocap.erase(std::remove_if(mocap.begin(), mocap.end(), cut), mocap.end());
  StraightBox box = AlongX();
  box.heading = 0.0;
  const auto straights = StraightsInBoxes(mocap, {box}, {});
  ASSERT_EQ(straights.size(), 1U);  // 0.6 m before the gap is too short, 1.6 m after is not
  EXPECT_NEAR(SecondsBetween(straights[0].from, straights[0].to), 1.6 / kSpeed, 0.02);
}

// A straight of 3 m along x at 1 m/s, flown many times; gate at x = 3.
struct Course {
  std::vector<PoseSample> mocap;
  std::vector<Straight> straights;
};

Course ManyStraights(int count) {
  Course course;
  for (int k = 0; k < count; ++k) {
    const TimeNs from = FromSeconds(10.0 * k);
    for (int i = 0; i <= 360; ++i) {
      course.mocap.push_back(
          {from + FromSeconds(i / 120.0), {i / 120.0, 0.0, -1.5}, Eigen::Quaterniond::Identity()});
    }
    course.straights.push_back({from, from + FromSeconds(3.0), {k % 2, {3.0, 0.0, -1.5}, 0.0}});
  }
  return course;
}

Eigen::Vector3d Truth(const Fix& fix) {
  return {ToSeconds(fix.t) - 10.0 * std::floor(ToSeconds(fix.t) / 10.0), 0.0, -1.5};
}

TEST(FixSampler, FollowsEquation33) {
  const Course course = ManyStraights(400);
  Random random(1);
  FixSamplerOptions options;
  options.sigma_floor = 1e-3;
  const auto fixes = SampleFixes(course.mocap, course.straights, options, random);
  double square = 0.0;
  for (const Fix& fix : fixes) {
    const double distance = 3.0 - Truth(fix).x();
    EXPECT_NEAR(fix.sigma, std::max(1e-3, 0.1 * distance), 1e-9);
    square += ((fix.p_E - Truth(fix)) / fix.sigma).squaredNorm() / 3.0;
  }
  // 400 * 17.5 fixes of three axes: the mean square has a standard deviation of 0.01.
  EXPECT_NEAR(square / static_cast<double>(fixes.size()), 1.0, 0.04);
}

TEST(FixSampler, DrawsBetween15And20OnEachStraight) {
  const Course course = ManyStraights(200);
  Random random(2);
  const auto fixes = SampleFixes(course.mocap, course.straights, {}, random);
  std::vector<int> count(course.straights.size(), 0);
  TimeNs previous = -1;
  for (const Fix& fix : fixes) {
    EXPECT_GT(fix.t, previous);
    previous = fix.t;
    const auto k = static_cast<std::size_t>(fix.t / (10 * kNsPerSecond));
    ++count[k];
    EXPECT_EQ(fix.gate, static_cast<int>(k % 2));
    EXPECT_GE(fix.sigma, 0.05);
  }
  EXPECT_EQ(*std::min_element(count.begin(), count.end()), 15);
  EXPECT_EQ(*std::max_element(count.begin(), count.end()), 20);
}

TEST(FixSampler, RepeatsWithTheSeed) {
  const Course course = ManyStraights(3);
  const auto sample = [&](std::uint64_t seed) {
    Random random(seed);
    return SampleFixes(course.mocap, course.straights, {}, random);
  };
  EXPECT_EQ(sample(5).front().p_E, sample(5).front().p_E);
  EXPECT_NE(sample(5).front().p_E, sample(6).front().p_E);
}

TEST(FixSampler, MakesOutliersAndHeavyTails) {
  const Course course = ManyStraights(400);
  const auto share_beyond = [&](const FixSamplerOptions& options, double sigmas) {
    Random random(3);
    const auto fixes = SampleFixes(course.mocap, course.straights, options, random);
    const auto far = std::count_if(fixes.begin(), fixes.end(), [&](const Fix& fix) {
      return std::abs(fix.p_E.y() / fix.sigma) > sigmas;
    });
    return static_cast<double>(far) / static_cast<double>(fixes.size());
  };
  FixSamplerOptions gauss, outliers, heavy;
  outliers.outlier_share = 0.1;
  outliers.outlier_size = 20.0;
  heavy.student_dof = 3.0;
  EXPECT_LT(share_beyond(gauss, 5.0), 1e-3);
  EXPECT_NEAR(share_beyond(outliers, 5.0), 0.1, 0.025);
  EXPECT_NEAR(share_beyond(heavy, 5.0), 0.0154, 0.006);  // of Student's t with 3 degrees
}

TEST(FixSampler, LeavesGapsOfMocapOut) {
  Course course = ManyStraights(20);
  const auto hidden = [](const PoseSample& p) { return p.p_E.x() > 1.0 && p.p_E.x() < 2.0; };
  course.mocap.erase(std::remove_if(course.mocap.begin(), course.mocap.end(), hidden),
                     course.mocap.end());
  Random random(4);
  const auto fixes = SampleFixes(course.mocap, course.straights, {}, random);
  EXPECT_GT(fixes.size(), 150U);
  for (const Fix& fix : fixes) EXPECT_FALSE(Truth(fix).x() > 1.01 && Truth(fix).x() < 1.99);
}

TEST(FixSampler, RefusesOptionsThatCantBe) {
  FixSamplerOptions options;
  options.max_count = 3;
  EXPECT_THAT(ErrorOf([&] { options.Check(); }),
              HasSubstr("'max_count' must not be below min_count"));
}

}  // namespace
}  // namespace trueline
