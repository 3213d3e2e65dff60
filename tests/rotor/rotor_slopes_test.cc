// Derivatives in four columns at a time against Jets of all errors, which shows a missing column,
// and against finite differences, which need no Jets.
#include "problems/rotor/rotor_slopes.h"

#include <gtest/gtest.h>

#include <numeric>

#include "problems/effects/declaration.h"
#include "problems/effects/effect.h"
#include "problems/rotor/rotor_step.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

// d(error state of the moving part) / d(seeds) of Jets whose value is `x`: kMovingErrors x seeds.
template <class Jet>
Eigen::Matrix<double, RotorAeroModel::kMovingErrors, Jet::DIMENSION> MovingSensitivity(
    const Jet* x) {
  Eigen::Matrix<double, RotorAeroModel::kMovingErrors, Jet::DIMENSION> sensitivity;
  const Vec4<double> q(x[0].a, x[1].a, x[2].a, x[3].a);
  const Vec4<double> back = Conjugate(q) / q.squaredNorm();
  for (int j = 0; j < Jet::DIMENSION; ++j) {
    const Vec4<double> dq(x[0].v[j], x[1].v[j], x[2].v[j], x[3].v[j]);
    sensitivity.col(j).template head<3>() = 2.0 * HamiltonProduct(back, dq).template tail<3>();
  }
  for (int i = 4; i < RotorAeroModel::kMoving; ++i) sensitivity.row(i - 1) = x[i].v.transpose();
  return sensitivity;
}

// Every effect at once, in the middle of a hard turn near the floor, and terms that go with place,
// heading and speed.
RotorEffects AllEffects() {
  RotorEffects effects =
      RotorExtensionOf({{"thrust_sag", {{"d", 0.02}}},
                        {"rotor_loss", {{"rotor", 1}, {"factor", 0.8}}},
                        {"rotor_speed_drag", {{"k", 2e-4}}},
                        {"translational_lift", {{"k", 0.3}}},
                        {"body_drag", {{"c_x", 0.3}, {"c_y", 0.2}, {"c_z", 0.4}}},
                        {"air_moment", {{"roll", 3e-4}, {"pitch", -5e-4}}},
                        {"ground_effect", {{"k", 0.4}}},
                        {"payload_step", {{"t_step", 1.0}, {"mass", 0.05}}},
                        {"com_step", {{"t_step", 1.0}, {"dx", 0.01}, {"dy", -0.02}}},
                        {"rotor_tilt", {{"roll", 0.05}, {"pitch", -0.1}}}})
          .effects;
  for (const auto& [where, with] : {std::pair{"force_north", "place(0.2,-0.3;1.5)"},
                                    {"force_x", "sin(psi)"},
                                    {"moment_y", "v_x"}}) {
    const TermForm term = ParseTerm(where, with);
    effects.terms.push_back({term.on, term.axis, term.with, 0.8});
  }
  return effects;
}

const Eigen::Vector3d kNoDrift = Eigen::Vector3d::Zero();

RotorState StateOf(std::uint64_t seed) {
  Random random(seed, "state");
  RotorConstants constants = PriorFromVehicle(WuestVehicle()).mean;
  for (double& c : constants) c *= 1.0 + 0.1 * random.Normal();
  constants.tail<14>() << -0.3, -0.2, -0.1, 1e-4, -6.0, -5.0, -1.0, -4.0, 3.0, 2e-5, 0.01, 0.03,
      0.1, 1.0;
  MovingState node;
  const Eigen::Quaterniond q(Eigen::AngleAxisd(1.0, random.NormalVector3().normalized()));
  node << q.w(), q.x(), q.y(), q.z(), random.NormalVector3().head<2>(), -0.7,
      2.0 * random.NormalVector3(), 4.0 * random.NormalVector3();
  return Joined(node, constants);
}

RotorInput Input() {
  RotorInput input{2.0, {1400, 1200, 1500, 1300}, {900, -700, 400, 200}};
  input.slopes.assign(4, MotorValues(-900.0, 1500.0, 300.0));
  input.motors = MotorValues(0.025, 0.12, 0.9);
  return input;
}

class RotorSlopesTest : public testing::TestWithParam<int> {
 protected:
  RotorAeroModel plain{WuestVehicle().model.rotors(), 9.81};
  RotorAeroModel all{WuestVehicle().model.rotors(), 9.81, AllEffects()};
  RotorState x = StateOf(GetParam());
};

TEST_P(RotorSlopesTest, SpeedsMoveForceAndTurn) {
  constexpr double kStep = 1.0;  // rad/s
  RotorInput input = Input();
  input.slopes.clear();
  x[RotorAeroModel::kInflow] = x[RotorAeroModel::kRotorInertia] = 0.0;
  const auto by = plain.BySpeeds(x.data(), input);
  for (int r = 0; r < plain.num_rotors(); ++r) {
    RotorInput up = input, down = input;
    up.speeds[r] += kStep, down.speeds[r] -= kStep;
    const auto a = plain.BodyAccelerationOf(x.data(), up),
               b = plain.BodyAccelerationOf(x.data(), down);
    EXPECT_LT((by.col(r).head<3>() - (a.force - b.force) / (2.0 * kStep)).norm(), 1e-9);
    EXPECT_LT((by.col(r).tail<3>() - (a.turn - b.turn) / (2.0 * kStep)).norm(), 1e-9);
  }
}

TEST_P(RotorSlopesTest, ReadingsAndTheirSlopesAreThoseOfJets) {
  for (const RotorAeroModel* model : {&plain, &all}) {
    std::array<RotorJet, RotorAeroModel::kStates> jets;
    std::array<RotorJet, 6> y;
    SeedErrors(x, jets.data());
    model->Imu(jets.data(), Input(), y.data());
    const RotorReading reading = ReadWithSlope(*model, x, Input(), kNoDrift);
    for (int i = 0; i < 6; ++i) {
      EXPECT_NEAR(reading.y[i], y[i].a, 1e-9) << i;
      for (int j = 0; j < RotorAeroModel::kErrors; ++j) {
        EXPECT_NEAR(reading.slope(i, j), y[i].v[j], 1e-9 * (1.0 + std::abs(y[i].v[j])))
            << i << " by " << j;
      }
    }
  }
}

TEST_P(RotorSlopesTest, AStepAndItsSlopeAreThoseOfJets) {
  constexpr double kStep = 0.004;  // s
  Eigen::Matrix<double, 6, 1> disturbance;
  disturbance << 0.5, -0.3, 0.2, 3.0, -2.0, 1.0;
  for (const RotorAeroModel* model : {&plain, &all}) {
    std::array<RotorJet, RotorAeroModel::kStates> jets;
    std::array<RotorJet, 6> held;
    for (int i = 0; i < 6; ++i) held[i] = RotorJet(disturbance[i]);
    SeedErrors(x, jets.data());
    RotorMidpointStep(*model, Input(), held.data(), kStep, jets.data());
    const RotorStepMatrix expected = MovingSensitivity(jets.data());
    RotorState end = x;
    const RotorStepMatrix slope = StepWithSlope(*model, Input(), disturbance, kStep, &end).by_error;
    for (int i = 0; i < RotorAeroModel::kStates; ++i) EXPECT_NEAR(end[i], jets[i].a, 1e-12) << i;
    // Column by column, because constants differ in size.
    for (int j = 0; j < RotorAeroModel::kErrors; ++j) {
      EXPECT_LT((slope.col(j) - expected.col(j)).norm(), 1e-9 * expected.col(j).norm() + 1e-12)
          << "by " << j;
    }
  }
}

TEST_P(RotorSlopesTest, SlopesAreThoseOfFiniteDifferences) {
  constexpr double kStep = 0.004;  // s
  const Eigen::Matrix<double, 6, 1> still = Eigen::Matrix<double, 6, 1>::Zero();
  for (const RotorAeroModel* model : {&plain, &all}) {
    RotorState end = x;
    const RotorStepMatrix moved = StepWithSlope(*model, Input(), still, kStep, &end).by_error;
    const RotorReading reading = ReadWithSlope(*model, x, Input(), kNoDrift);
    for (int j = 0; j < RotorAeroModel::kErrors; ++j) {
      const double h = j < 3 ? 1e-4 : 1e-4 * std::max(1e-2, std::abs(x[j + 1]));
      Eigen::Matrix<double, 6, 1> by_reading = still;
      RotorError by_step = RotorError::Zero();
      for (const double sign : {-1.0, 1.0}) {
        RotorState at = Plus(x, sign * h * RotorError::Unit(j));
        Eigen::Matrix<double, 6, 1> y;
        model->Imu(at.data(), Input(), y.data());
        by_reading += sign / (2.0 * h) * y;
        RotorMidpointStep(*model, Input(), still.data(), kStep, at.data());
        by_step += sign / (2.0 * h) * Minus(end, at);
      }
      const Eigen::Matrix<double, RotorAeroModel::kMovingErrors, 1> by_move =
          by_step.head<RotorAeroModel::kMovingErrors>();
      EXPECT_LT((reading.slope.col(j) - by_reading).norm(), 1e-5 * (1.0 + by_reading.norm()))
          << "reading by " << j;
      EXPECT_LT((moved.col(j) - by_move).norm(), 1e-5 * by_move.norm() + 1e-9) << "step by " << j;
    }
  }
}

// Asked for some constants only, the columns of the moving state and of these constants are the
// same as those by all.
TEST_P(RotorSlopesTest, ColumnsOfSomeConstantsAreThoseOfAll) {
  const std::vector<int> some = {FindRotorConstant("r_BM_y"), FindRotorConstant("k_f"),
                                 FindRotorConstant("r_BI_x"), FindRotorConstant("b_w_z"),
                                 FindRotorConstant("motor_lag")};
  const Eigen::Matrix<double, 6, 1> still = Eigen::Matrix<double, 6, 1>::Zero();
  for (const RotorAeroModel* model : {&plain, &all}) {
    RotorState end = x, end_of_some = x;
    const RotorStepMatrix step = StepWithSlope(*model, Input(), still, 0.004, &end).by_error;
    const RotorStepMatrix step_of_some =
        StepWithSlope(*model, Input(), still, 0.004, &end_of_some, SlopeColumns(some)).by_error;
    const RotorReading reading = ReadWithSlope(*model, x, Input(), kNoDrift);
    const RotorReading reading_of_some =
        ReadWithSlope(*model, x, Input(), kNoDrift, SlopeColumns(some));
    EXPECT_EQ(end, end_of_some);
    EXPECT_EQ(reading.y, reading_of_some.y);
    std::vector<int> columns(RotorAeroModel::kMovingErrors);
    std::iota(columns.begin(), columns.end(), 0);
    for (const int i : some) columns.push_back(RotorAeroModel::kMovingErrors + i);
    for (const int j : columns) {
      EXPECT_LT((step.col(j) - step_of_some.col(j)).norm(), 1e-12 * (1.0 + step.col(j).norm()))
          << "by " << j;
      EXPECT_LT((reading.slope.col(j) - reading_of_some.slope.col(j)).norm(),
                1e-12 * (1.0 + reading.slope.col(j).norm()))
          << "by " << j;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(States, RotorSlopesTest, testing::Range(1, 6));

}  // namespace
}  // namespace trueline
