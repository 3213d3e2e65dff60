// The derivatives of preintegrated motion against its equations in Jets of all columns at once.
#include <gtest/gtest.h>

#include "cost_functions/models/motion_block.h"
#include "problems/effects/effect.h"
#include "tests/vgd/flown_log.h"

namespace trueline {
namespace {

struct Case {
  ThrustAxis axis;
  std::vector<Effect> effects;
};

class MotionSlopes : public testing::TestWithParam<Case> {};

TEST_P(MotionSlopes, AreThoseOfJets) {
  MotionJet theta[kMotionSize];
  const double values[kMotionSize] = {-0.5, -0.7, 0.3, 0.03, -0.02, 0.4, -0.02, 0.04, 0.3};
  for (int i = 0; i < kMotionSize; ++i)
    theta[kMotionOrder[i]] = MotionJet(values[kMotionOrder[i]], i);
  const ForceEffects effects = ForceEffectsOf(GetParam().effects);
  const BlockModel<MotionJet> model(
      {ImuDrivenParameters<MotionJet>::FromArray(theta), 9.81, GetParam().axis}, &effects);
  MotionState<MotionJet> fast;
  for (int i = 0; i < 3; ++i) fast.v[i] = MotionJet(3.0 - 2.0 * i, kMotionSize + i);
  MotionState<MotionJet> jets = fast;
  for (int block = 0; block < 60; ++block) {
    MotionBlock m{0.05 * block, 0.05};
    for (int i = 0; i < 20; ++i) {
      const double t = m.t + 0.0025 * (i + 0.5);
      m.Append({testing_window::AttitudeAt(t).toRotationMatrix(), testing_window::ThrustAt(t)},
               0.0025);
    }
    Propagate(model, m, &fast);
    Propagate<MotionJet>(model, m, &jets);
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(fast.p[i].a, jets.p[i].a, 1e-12);
    EXPECT_NEAR(fast.v[i].a, jets.v[i].a, 1e-12);
    EXPECT_LT((fast.p[i].v - jets.p[i].v).norm(), 1e-12 * (1.0 + jets.p[i].v.norm()));
    EXPECT_LT((fast.v[i].v - jets.v[i].v).norm(), 1e-12 * (1.0 + jets.v[i].v.norm()));
  }
}

INSTANTIATE_TEST_SUITE_P(Models, MotionSlopes,
                         testing::Values(Case{ThrustAxis::kBody, {}}, Case{ThrustAxis::kImu, {}},
                                         Case{ThrustAxis::kImu,
                                              {{"quadratic_drag", {{"c", 0.1}}},
                                               {"wind", {{"w_x", 2.0}, {"w_y", -1.0}}}}}));

}  // namespace
}  // namespace trueline
