// Passes, truth at their start, robust lines and rough paths, preintegrated chains.
#include <gtest/gtest.h>

#include "problems/common/random.h"
#include "problems/vgd/force_samples.h"
#include "problems/vgd/motion_chain.h"
#include "problems/vgd/rough_path.h"
#include "tests/vgd/flown_log.h"

namespace trueline {
namespace {

using Eigen::Vector3d;

const Vector3d kP0(1.0, -2.0, -1.5), kV(1.8, 0.4, 0.1);
Vector3d LineAt(double t) { return kP0 + kV * t; }

std::vector<Fix> LineFixes(double from, double to, double step) {
  std::vector<Fix> fixes;
  for (double t = from; t < to + 1e-9; t += step) {
    fixes.push_back({FromSeconds(t), LineAt(t), 0.1, 0});
  }
  return fixes;
}

std::vector<Fix> Joined(std::vector<Fix> a, const std::vector<Fix>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(FindPasses, EndsAPassAtAPauseLongerThanTheGap) {
  const std::vector<Fix> fixes =
      Joined(Joined(LineFixes(0.0, 0.9, 0.1), LineFixes(2.0, 2.1, 0.1)), LineFixes(5.0, 6.0, 0.6));
  const std::vector<Pass> passes = FindPasses(fixes, {.pass_gap = 0.7, .min_fixes = 2});
  ASSERT_EQ(passes.size(), 3U);
  EXPECT_EQ(passes[0].first, 0U);
  EXPECT_EQ(passes[0].last, 9U);
  EXPECT_EQ(passes[1].begin, FromSeconds(2.0));
  EXPECT_EQ(passes[2].last, 13U);
  EXPECT_EQ(FindPasses(fixes, {.pass_gap = 0.7, .min_fixes = 3}).size(), 1U);
  EXPECT_EQ(FindPasses(fixes, {.pass_gap = 0.5, .min_fixes = 2}).size(), 2U);
  EXPECT_TRUE(FindPasses({}, PassOptions()).empty());
}

TEST(FitLine, FindsALineExactly) {
  const std::vector<Fix> fixes = LineFixes(1.0, 2.0, 0.05);
  const LineFit line = FitLine(fixes, 0, fixes.size() - 1, FromSeconds(3.0));
  EXPECT_LT((line.p - LineAt(3.0)).norm(), 1e-3);
  EXPECT_LT((line.v - kV).norm(), 1e-3);
}

TEST(FitLine, IsHardlyMovedByOutliers) {
  std::vector<Fix> fixes = LineFixes(1.0, 2.0, 0.05);
  Random random(2, "line");
  for (Fix& fix : fixes) fix.p_E += 0.1 * random.NormalVector3();
  fixes[3].p_E += Vector3d(5, -4, 3);
  fixes[15].p_E += Vector3d(4, -4, 2);
  const LineFit line = FitLine(fixes, 0, fixes.size() - 1, FromSeconds(1.5));
  EXPECT_LT((line.p - LineAt(1.5)).norm(), 0.12);  // the outliers move the mean by 0.6 m
}

TEST(FitLine, IsDefinedForOneFix) {
  const std::vector<Fix> fixes = LineFixes(1.0, 1.0, 0.1);
  const LineFit line = FitLine(fixes, 0, 0, FromSeconds(4.0));
  EXPECT_LT((line.p - LineAt(1.0)).norm(), 1e-9);
  EXPECT_LT(line.v.norm(), 1e-9);
}

// Over the arc between two passes on one line the cubic curve is that line.
TEST(RoughPath, ContinuesLinesThroughArcs) {
  const std::vector<Fix> fixes = Joined(LineFixes(0.0, 1.0, 0.1), LineFixes(3.0, 4.0, 0.1));
  const std::vector<Pass> passes = FindPasses(fixes, PassOptions());
  const RoughPath path(fixes, passes);
  for (const double t : {0.0, 0.55, 1.0, 1.4, 2.3, 3.0, 3.7, 4.0}) {
    const LineFit at = path.At(FromSeconds(t));
    EXPECT_LT((at.p - LineAt(t)).norm(), 5e-3) << t;
    EXPECT_LT((at.v - kV).norm(), 5e-3) << t;
  }
  EXPECT_EQ(path.end(), FromSeconds(4.0));
}

// A half circle between two straights: continuous, and its velocity is its derivative.
TEST(RoughPath, IsSmoothOverATurn) {
  std::vector<Fix> fixes;
  for (double t = 0.0; t < 1.01; t += 0.1) {
    fixes.push_back({FromSeconds(t), Vector3d(2.0 * t, 0, -1), 0.1, 0});
  }
  for (double t = 3.0; t < 4.01; t += 0.1) {
    fixes.push_back({FromSeconds(t), Vector3d(2.0 - 2.0 * (t - 3.0), 2.5, -1), 0.1, 1});
  }
  const std::vector<Pass> passes = FindPasses(fixes, PassOptions());
  const RoughPath path(fixes, passes);
  for (double t = 1.1; t < 3.0; t += 0.2) {
    const double h = 1e-3;
    const Vector3d slope =
        (path.At(FromSeconds(t + h)).p - path.At(FromSeconds(t - h)).p) / (2.0 * h);
    EXPECT_LT((slope - path.At(FromSeconds(t)).v).norm(), 1e-4) << t;
  }
  EXPECT_GT(path.At(FromSeconds(2.0)).p.x(), 2.2);  // the path bulges out, as the vehicle's does
}

FlightLog WithMocap() {
  FlightLog log;
  for (int i = 0; i <= 40; ++i) {
    if (i > 20 && i < 30) continue;  // an outage from 2.0 to 3.0 s
    log.mocap.push_back({FromSeconds(0.1 * i), LineAt(0.1 * i), Eigen::Quaterniond::Identity()});
  }
  return log;
}

TEST(TruthAtPass, InterpolatesMocap) {
  const FlightLog log = WithMocap();
  Pass next{0, 0, FromSeconds(1.234), FromSeconds(1.5)};
  const auto truth = TruthAtPass(log, next);
  ASSERT_TRUE(truth.has_value());
  EXPECT_TRUE(truth->from_mocap);
  EXPECT_LT((truth->p_E - LineAt(1.234)).norm(), 1e-9);
}

TEST(TruthAtPass, IsUnknownInAnOutageOfMocap) {
  const FlightLog log = WithMocap();
  EXPECT_FALSE(TruthAtPass(log, {0, 0, FromSeconds(2.5), 0}).has_value());
  EXPECT_FALSE(TruthAtPass(log, {0, 0, FromSeconds(9.0), 0}).has_value());
  EXPECT_FALSE(TruthAtPass(log, {0, 0, FromSeconds(-1.0), 0}).has_value());
  EXPECT_TRUE(TruthAtPass(log, {0, 0, FromSeconds(3.0), 0}).has_value());
}

TEST(TruthAtPass, WithoutMocapFollowsTheNextPassRobustly) {
  FlightLog log;
  log.fixes = LineFixes(5.0, 6.0, 0.05);
  Random random(4, "truth");
  for (Fix& fix : log.fixes) fix.p_E += 0.05 * random.NormalVector3();
  log.fixes[2].p_E += Vector3d(3, 3, 0);  // a false gate among the first five
  const Pass next{0, log.fixes.size() - 1, log.fixes.front().t, log.fixes.back().t};
  const auto truth = TruthAtPass(log, next);
  ASSERT_TRUE(truth.has_value());
  EXPECT_FALSE(truth->from_mocap);
  EXPECT_LT((truth->p_E - LineAt(5.0)).norm(), 0.25);
}

TEST(TruthAtPass, MocapThatIsTooSlowToInterpolateIsNoTruth) {
  FlightLog log = WithMocap();
  log.fixes = LineFixes(1.0, 2.0, 0.05);
  const std::vector<PoseSample> all = std::exchange(log.mocap, {});
  for (const PoseSample& pose : all) {
    if (log.mocap.empty() || SecondsBetween(log.mocap.back().t, pose.t) > 0.3) {
      log.mocap.push_back(pose);
    }
  }
  const auto truth = TruthAtPass(log, {0, log.fixes.size() - 1, log.fixes.front().t, 0});
  ASSERT_TRUE(truth.has_value());
  EXPECT_FALSE(truth->from_mocap);
}

// The preintegrated chain against direct integration, over irregular times and a long stretch.
TEST(MotionChain, AgreesWithDirectIntegration) {
  const DriveTrack track = DriveTrack::FromLog(testing_window::FlownLog(8.0), DriveOptions());
  const double theta[kMotionSize] = {-0.5, -0.7, 0.3, 0.03, -0.02, 0.05, -0.02, 0.04, 0.03};
  const MotionState<double> start{Vector3d(1, 2, -1), Vector3d(0.5, -1.0, 0.2)};
  const std::vector<TimeNs> times = {FromSeconds(0.5), FromSeconds(0.5073), FromSeconds(3.1),
                                     FromSeconds(7.9)};
  const TimeNs begin = FromSeconds(0.2011);
  const MotionChain chain(track, begin, times);
  const ImuDrivenModel<double> model(ImuDrivenParameters<double>::FromArray(theta), 9.81,
                                     track.thrust_axis());
  std::size_t visits = 0;
  chain.Integrate(model, start, [&](std::size_t i, const auto& state, const Vector3d& v_Ep) {
    const auto direct =
        testing_window::Integrate(track, theta, {start.p, start.v}, begin, times[i]);
    EXPECT_LT((state.p - direct.p).norm(), 1e-3) << "at time " << i;
    EXPECT_LT((state.v - direct.v).norm(), 1e-3) << "at time " << i;
    EXPECT_LT((model.R_Ep_E() * state.v - v_Ep).norm(), 1e-12);
    ++visits;
  });
  EXPECT_EQ(visits, times.size());
}

TEST(AverageForces, AveragesAndLearnsTheScatter) {
  std::vector<ImuSample> imu;
  Random random(5, "forces");
  for (int i = 0; i < 4000; ++i) {
    const Vector3d noise = 5.0 * random.NormalVector3();
    if (i >= 2000 && i < 2100) continue;  // a gap of half a second
    imu.push_back({FromSeconds(0.005 * i), Vector3d(0.3, -0.4, -9.8) + noise, Vector3d::Zero()});
  }
  const ForceSamples forces = AverageForces(imu, DragMeasurementOptions());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const ForceSample& sample : forces.samples) {
    mean += sample.accel_xy / static_cast<double>(forces.samples.size());
    EXPECT_FALSE(sample.t > FromSeconds(10.0) && sample.t < FromSeconds(10.495));
  }
  EXPECT_LT((mean - Eigen::Vector2d(0.3, -0.4)).norm(), 0.3);
  EXPECT_NEAR(forces.sigma, 5.0 / std::sqrt(20.0), 0.18);  // twenty samples in 0.1 s
}

TEST(AverageForces, TrustsNoMeanMoreThanTheFloor) {
  std::vector<ImuSample> imu;
  for (int i = 0; i < 400; ++i) {
    imu.push_back({FromSeconds(0.005 * i), Vector3d(0.3, -0.4, -9.8), Vector3d::Zero()});
  }
  EXPECT_EQ(AverageForces(imu, DragMeasurementOptions()).sigma, DragMeasurementOptions().sigma);
}

}  // namespace
}  // namespace trueline
