#include "cost_functions/models/window_prediction.h"

#include <gtest/gtest.h>

#include "tests/prediction/made_run.h"

namespace trueline {
namespace {

Eigen::Vector4d Turned(double roll, double heading) {
  const Eigen::Quaterniond q = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
  return {q.w(), q.x(), q.y(), q.z()};
}

// A quaternion and its negative are one attitude.
TEST(WindowPrediction, AnglesDoNotDependOnTheSignOfTheQuaternion) {
  for (const double heading : {-0.4, 0.0, 0.3}) {
    const Eigen::Vector4d q = Turned(0.2, heading);
    const Eigen::Vector3d angles = WindowPrediction::AttitudeAngles(q);
    EXPECT_LT((WindowPrediction::AttitudeAngles(-q) - angles).norm(), 1e-12) << heading;
    EXPECT_NEAR(angles.x(), 0.2, 1e-9);
  }
}

// A heading far from zero is flown on purpose: nothing holds it.
TEST(WindowPrediction, AHeadingFarFromZeroIsNotHeld) {
  for (const double heading : {1.6, 3.1, -2.0}) {
    EXPECT_EQ(WindowPrediction::AttitudeAngles(Turned(0.2, heading)).z(), 0.0) << heading;
  }
}

// A vehicle that swings along x. Its filter knows no drag: the logged pitch lacks what the drag of
// the velocity's slow part takes (room_path.h).
struct BlindFlight {
  static constexpr double kSwing = 1.5, kSize = 0.6, kStart = 0.3;  // rad/s, m; phase
  std::vector<double> numbers = testing_prediction::SmallNumbers();
  FittedRotors vehicle = testing_prediction::SmallVehicle().Model();
  double drag = 0.0;  // 1/s

  BlindFlight() {
    const auto names = testing_prediction::SmallSetup().numbers;
    for (const char* name : {"inflow", "L_p", "M_q", "N_r", "L_v", "M_u", "J_r", "b_w"}) {
      numbers[testing_prediction::IndexOf(name, names)] = 0.0;
    }
    drag = vehicle.LinearDrag(&numbers[WindowPrediction::kRotors], Rotors(0.0, 0.0));
  }

  // x, v, pitch, its rate and acceleration, logged pitch.
  Eigen::Matrix<double, 6, 1> At(double t) const {
    constexpr std::complex<double> kRate(0.0, kSwing);
    const double g = vehicle.gravity();
    const std::complex<double> x = std::polar(kSize, kSwing * t + kStart), v = kRate * x,
                               pitch = (kRate * v + drag * v) / g,
                               logged = pitch - drag / g * v / (1.0 + kRate);
    Eigen::Matrix<double, 6, 1> state;
    state << x.real(), v.real(), pitch.real(), (kRate * pitch).real(),
        (kRate * kRate * pitch).real(), logged.real();
    return state;
  }
  RotorInput Rotors(double pitch, double turn) const {
    const double* constants = &numbers[WindowPrediction::kRotors];
    const double mass = constants[FittedRotors::NumberOf(RotorDrivenModel::kMass)];
    const double inertia = constants[FittedRotors::NumberOf(RotorDrivenModel::kInertia + 1)];
    RotorInput input;
    const PredictedVehicle small = testing_prediction::SmallVehicle();
    for (const Rotor& rotor : small.stated.model.rotors()) {
      const double thrust = 0.25 * mass * vehicle.gravity() / std::cos(pitch) -
                            0.25 * inertia * turn / rotor.position.x();
      input.speeds.push_back(std::sqrt(thrust / rotor.k_f));
    }
    return input;
  }
  PredictionWindow Window(double t) const {
    PredictionWindow window;
    const auto state = At(t);
    window.p = {state[0], 0.0, 0.0};
    window.v = {state[1], 0.0, 0.0};
    window.q = {std::cos(0.5 * state[5]), 0.0, std::sin(0.5 * state[5]), 0.0};
    window.w = {0.0, state[3], 0.0};
    for (int k = 0; k < PredictionWindow::kSteps; ++k) {
      const auto middle = At(t + 0.01 * (k + 0.5));
      window.rotors[k] = Rotors(middle[2], middle[4]);
    }
    return window;
  }
  // Mean errors after half a second: velocity [m/s], tilt [rad].
  Eigen::Vector2d Errors(const FastVelocity& fast) const {
    StabilisedProcessNumbers undisturbed;
    undisturbed.constant = undisturbed.coloured = undisturbed.white = 0.01;
    const WindowPrediction::Process process = {StabilisedProcess(undisturbed),
                                               StabilisedProcess(undisturbed)};
    const FusedVelocity velocity(FusedVelocityNumbers{});
    const WindowPrediction prediction(vehicle, process, velocity, fast);
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (int i = 0; i < 20; ++i) {
      PredictedStates<double> states;
      prediction.Predict(numbers.data(), Window(0.2 * i), &states);
      const auto end = At(0.2 * i + 0.5);
      const double pitch = 2.0 * std::atan2(states.back().q[2], states.back().q[0]);
      sum += Eigen::Vector2d(states.back().v[0] - end[1], pitch - end[5]).cwiseAbs() / 20.0;
    }
    return sum;
  }
};

TEST(WindowPrediction, AFilterThatKnowsNoDragIsAllowedFor) {
  const BlindFlight flight;
  const Eigen::Vector2d errors = flight.Errors(FastVelocity());
  constexpr double kNever = 1e6;  // s: all of the velocity is fast, none is lost
  const Eigen::Vector2d without = flight.Errors(FastVelocity(kNever));
  EXPECT_LT(errors[0], 0.5 * without[0]);
  EXPECT_LT(errors[1], 0.5 * without[1]);
}

TEST(WindowPrediction, BrakesAgainstTheSpeed) {
  PredictionWindow window;
  window.p.setZero();
  window.v = {0.5, -0.8, 0.0};
  window.q = Turned(0.0, 0.0);
  window.w.setZero();
  window.rotors.fill({0.0, std::vector<double>(4, 1722.0)});
  std::vector<double> numbers = testing_prediction::SmallNumbers();
  const auto rates = [&](double braking) {
    numbers[WindowPrediction::kBraking] = braking;
    const PredictionModel model(testing_prediction::SmallVehicle(), {}, numbers);
    PredictedStates<double> states;
    model.prediction.Predict(numbers.data(), window, &states);
    return states[24].w;
  };
  const Eigen::Vector3d change = rates(0.14) - rates(0.0);
  const double most = 0.14 * (1.0 - std::exp(-1.0));  // after 0.25 s
  EXPECT_NEAR(change.x(), -0.8 * most, 0.15 * most);
  EXPECT_NEAR(change.y(), -0.5 * most, 0.15 * most);
}

}  // namespace
}  // namespace trueline
