#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/trajectory/mocap_path.h"

namespace trueline {
namespace {

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
  try {
    options.Check();
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("'max_count' must not be below min_count"));
  }
}

}  // namespace
}  // namespace trueline
