// The derivatives of preintegrated motion against Jets of all columns at once.
#include <gtest/gtest.h>

#include "problems/vgd/motion_chain.h"
#include "tests/vgd/flown_log.h"

namespace trueline {
namespace {

using Jet = ceres::Jet<double, kMotionColumns>;

class MotionSlopesOn : public testing::TestWithParam<ThrustAxis> {};

TEST_P(MotionSlopesOn, AreThoseOfJets) {
  const DriveTrack track = DriveTrack::FromLog(testing_window::FlownLog(4.0), DriveOptions());
  const double theta[kMotionSize] = {-0.5, -0.7, 0.3, 0.03, -0.02, 0.4, -0.02, 0.04, 0.3};
  Eigen::Matrix<double, kMotionSize, 1> unit;
  for (int i = 0; i < kMotionSize; ++i) unit[i] = 0.3 - 0.02 * i;
  const Eigen::Vector3d v_E(3.0, -1.0, 0.2);
  const MotionChain chain(track, FromSeconds(0.2011),
                          {FromSeconds(0.5), FromSeconds(0.5073), FromSeconds(3.7)});
  Jet jets[kMotionSize];
  for (int i = 0; i < kMotionSize; ++i) {
    jets[i] = Jet(theta[i]);
    jets[i].v[i] = unit[i];
  }
  MotionState<Jet> start;
  for (int i = 0; i < 3; ++i) start.v[i] = Jet(v_E[i], kMotionSize + i);
  std::vector<MotionState<Jet>> expected;
  chain.Integrate(
      ImuDrivenModel<Jet>(ImuDrivenParameters<Jet>::FromArray(jets), 9.81, GetParam()), start,
      [&](std::size_t, const MotionState<Jet>& x, const auto&) { expected.push_back(x); });

  const ImuDrivenModel<double> model(ImuDrivenParameters<double>::FromArray(theta), 9.81,
                                     GetParam());
  const LinearisedModel linearised(model, v_E, unit);
  std::size_t visits = 0;
  chain.IntegrateWithSlopes(linearised, [&](std::size_t i, const MotionState<double>& state,
                                            const ChainSlopes<6>& slopes) {
    const Eigen::Matrix3d R_E_Ep = model.R_Ep_E().transpose();
    const Eigen::Vector3d p = R_E_Ep * state.p, v = R_E_Ep * state.v;
    const MotionSlopes<6> in_E = linearised.InEarth(state, slopes);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(p[axis], expected[i].p[axis].a, 1e-11);
      EXPECT_NEAR(v[axis], expected[i].v[axis].a, 1e-11);
      EXPECT_LT((in_E.row(axis) - expected[i].p[axis].v.transpose()).norm(), 1e-9);
      EXPECT_LT((in_E.row(3 + axis) - expected[i].v[axis].v.transpose()).norm(), 1e-9);
    }
    ++visits;
  });
  EXPECT_EQ(visits, 3U);
}

INSTANTIATE_TEST_SUITE_P(Axes, MotionSlopesOn,
                         testing::Values(ThrustAxis::kBody, ThrustAxis::kImu));

}  // namespace
}  // namespace trueline
