// The rotor-driven model of the estimators: that of Boehm et al. 2020, extended by further
// constants for real flights (linear drag, rotor inflow, moments of the air, delay of the pose
// sensor, motors that follow commands), by effects that a diagnosis has found, and by disturbances
// that make it a stochastic model.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "cost_functions/models/motor_model.h"
#include "cost_functions/models/rotor_constants.h"
#include "cost_functions/models/rotor_driven_model.h"
#include "cost_functions/models/rotor_effects.h"

namespace trueline {

// The model's input at one time.
struct RotorInput {
  double t = 0.0;                          // s, since the flight's first sample
  std::vector<double> speeds;              // rad/s
  std::vector<double> accelerations = {};  // rad/s^2; empty: none
  // Set where speeds come from commands: the speeds' derivatives by the motors' unknowns for each
  // rotor, and the unknowns' values at which they were computed. Empty where speeds are measured.
  std::vector<MotorValues> slopes = {};
  MotorValues motors = MotorValues::Zero();
};

class RotorAeroModel {
 public:
  using Base = RotorDrivenModel;
  enum Index : int {
    kDrag = Base::kStates,             // K_x, K_y, K_z of f_B = diag(K) v_B [1/s]
    kInflow = kDrag + 3,               // k of f_B,z = -k sum(omega) v_B,z [1]
    kDamping = kInflow + 1,            // L_p, M_q, N_r of dw_B = diag(L_p, M_q, N_r) w_B [1/s]
    kSpeedMoment = kDamping + 3,       // L_v, M_u of dw_x = L_v v_B,y, dw_y = M_u v_B,x [rad/m/s]
    kRotorInertia = kSpeedMoment + 2,  // J_r of each rotor about its axis [kg m^2]
    kPoseDelay,                        // a pose stamped t was measured at t - delay [s]
    kMotors,  // lag [s], idle share [1] and voltage exponent [1] (motor_model.h)
    kStates = kMotors + kMotorUnknowns
  };
  static constexpr int kMoving = Base::kMoving;
  static constexpr int kConstants = kStates - kMoving;
  static_assert(kConstants == std::size(kRotorConstants));
  // Error state: attitude in body axes, q = q0 (1, theta / 2), then one number for each state.
  static constexpr int kMovingErrors = kMoving - 1;
  static constexpr int kErrors = kStates - 1;

  RotorAeroModel(std::vector<Rotor> rotors, double gravity, const RotorEffects& effects = {})
      : base_(std::move(rotors), gravity), effects_(effects), tilt_(effects.Tilt()) {}

  const Base& base() const { return base_; }
  int num_rotors() const { return base_.num_rotors(); }
  const RotorEffects& effects() const { return effects_; }

  template <class T>
  struct BodyAcceleration {
    Vec3<T> force;  // m/s^2, specific force at the point p_E_M, in body axes
    Vec3<T> turn;   // rad/s^2, angular acceleration
  };

  // What an input alone gives: the sums over all rotors without the ground effect, and their
  // derivatives by the motors' unknowns (not set where speeds are measured).
  struct InputSums {
    Base::RotorSums<double> sums;
    std::array<Base::RotorSums<double>, kMotorUnknowns> slopes;
    // Of a rotor with J_r = 1 kg m^2 each, all together: angular momentum about the axes [1/s],
    // with its sign reversed, and its derivative [1/s^2].
    Eigen::Vector3d momentum, reaction;
  };
  InputSums SumOver(const RotorInput& input) const {
    InputSums over{SumSquared(input.t, [&](int i) { return input.speeds[i] * input.speeds[i]; }),
                   {},
                   SumAlongAxes(input.speeds),
                   SumAlongAxes(input.accelerations)};
    if (input.slopes.empty()) return over;
    for (int j = 0; j < kMotorUnknowns; ++j) over.slopes[j] = SumSlopes(input, j);
    return over;
  }

  // The sums over all rotors in this state, with rotor effects. The motors' unknowns enter to first
  // order about the values in `input`; far from them, recompute the speeds.
  template <class T>
  Base::RotorSums<T> SumsOf(const T* x, const RotorInput& input, const InputSums& over) const {
    const T ground = effects_.GroundFactor(T(-x[Base::kPosition + 2]));
    Base::RotorSums<T> flown{Times(ground, over.sums.force), Times(ground, over.sums.lever),
                             over.sums.reaction.template cast<T>()};
    if (!input.slopes.empty()) AddMotors(x, input, over, ground, &flown);
    return flown;
  }
  // d(SumsOf) / d(unknown j of the motors), the ground effect left out.
  Base::RotorSums<double> SumSlopes(const RotorInput& input, int j) const {
    return SumSquared(input.t, [&](int i) { return 2.0 * input.speeds[i] * input.slopes[i][j]; });
  }
  // rad/s.
  static double SumOf(const RotorInput& input) {
    double sum = 0.0;
    for (const double speed : input.speeds) sum += speed;
    return sum;
  }

  // Force and moment of rotors and air. p_E_M stays at the centre of mass as built: if the centre
  // has since moved by c, that point has the centre's specific force less dw x c + w x (w x c).
  template <class T>
  BodyAcceleration<T> BodyAccelerationOf(const T* x, const RotorInput& input) const {
    return BodyAccelerationOf(x, input, SumOver(input));
  }
  template <class T>
  BodyAcceleration<T> BodyAccelerationOf(const T* x, const RotorInput& input,
                                         const InputSums& over) const {
    const auto wrench = Base::WrenchOf(x, SumsOf(x, input, over));
    const T per_mass = T(1.0) / (x[Base::kMass] + T(effects_.AddedMass(input.t)));
    const RotorAirFlow<T> air{AirSpeed(x), SumOf(input)};
    Vec3<T> moment = wrench.moment;
    RotorEffects::AddTo(&moment, effects_.moments, air);
    moment += RotorReaction(x, over);
    BodyAcceleration<T> acceleration{Scaled(per_mass, wrench.force) + AirForce(x, air), {}};
    const T thrust = -per_mass * wrench.force[2];
    const Eigen::Vector3d shift = effects_.CentreShift(input.t);
    if (shift.isZero(0.0)) {
      acceleration.turn = Base::AngularAcceleration(x, moment) + AirTurn(x, air);
      AddTerms(x, air.v_B, thrust, input.t, &acceleration);
      return acceleration;
    }
    const Vec3<T> c(T(shift.x()), T(shift.y()), T(shift.z())), w = Base::Vector(x, Base::kRate);
    acceleration.turn =
        Base::AngularAcceleration(x, Vec3<T>(moment - Cross(c, wrench.force))) + AirTurn(x, air);
    acceleration.force -= Cross(acceleration.turn, c) + Cross(w, Cross(w, c));
    AddTerms(x, air.v_B, thrust, input.t, &acceleration);
    return acceleration;
  }
  // The state as terms see it; `thrust` in m/s^2.
  template <class T>
  static TermState<T> TermStateOf(const T* x, const Vec3<T>& v_B, const T& thrust, double t) {
    const Vec4<T> q(x[0], x[1], x[2], x[3]);
    TermState<T> state{v_B, Base::Vector(x, Base::kRate), thrust, {}, {}, t};
    for (int i = 0; i < 3; ++i) {
      Vec3<T> unit = Vec3<T>::Zero();
      unit[i] = T(1);
      state.R_E_B.col(i) = RotateByUnit(q, unit);
    }
    state.p_E = Base::Vector(x, Base::kPosition);
    return state;
  }

  // d(specific force [m/s^2], angular acceleration [rad/s^2]) / d(speed [rad/s]) of each rotor by
  // its thrust and reaction moment, 6 x rotors. Air, ground and angular momentum are left out: they
  // add a few percent.
  Eigen::Matrix<double, 6, Eigen::Dynamic> BySpeeds(const double* x,
                                                    const RotorInput& input) const {
    const Vec3<double> none = Base::AngularAcceleration<double>(x, Vec3<double>::Zero());
    Eigen::Matrix<double, 6, Eigen::Dynamic> by(6, num_rotors());
    for (int r = 0; r < num_rotors(); ++r) {
      const auto wrench = Base::WrenchOf<double>(
          x, SumSquared(input.t, [&](int i) { return i == r ? 2.0 * input.speeds[i] : 0.0; }));
      by.col(r) << wrench.force / (x[Base::kMass] + effects_.AddedMass(input.t)),
          Base::AngularAcceleration<double>(x, wrench.moment) - none;
    }
    return by;
  }

  // dx/dt of the first kMoving states. `disturbance`: specific force in body axes [m/s^2], then
  // angular acceleration [rad/s^2]; 6 numbers.
  template <class T>
  void Derivative(const T* x, const RotorInput& input, const T* disturbance, T* dx) const {
    const BodyAcceleration<T> acceleration = BodyAccelerationOf(x, input);
    base_.Move(x, Vec3<T>(acceleration.force + Part(disturbance, 0)),
               Vec3<T>(acceleration.turn + Part(disturbance, 3)), dx);
  }

  // Accelerometer [m/s^2] then gyro [rad/s]: 6 numbers.
  template <class T>
  void Imu(const T* x, const RotorInput& input, T* y) const {
    const BodyAcceleration<T> acceleration = BodyAccelerationOf(x, input);
    Base::Read(x, acceleration.force, acceleration.turn, y);
  }

  // Position of P in E [m] as stamped: that of M and the arm, moved back over the delay (first
  // order in the delay).
  template <class T>
  static void Position(const T* x, T* y) {
    const T& delay = x[kPoseDelay];
    const Vec4<T> q(x[0], x[1], x[2], x[3]);
    const Vec3<T> arm = Base::Vector(x, Base::kPoseArm) - Base::Vector(x, Base::kCentre);
    const Vec3<T> turned = Cross(Base::Vector(x, Base::kRate), arm);
    const Vec3<T> before = RotateByUnit(q, Vec3<T>(arm - Scaled(delay, turned)));
    for (int i = 0; i < 3; ++i) {
      y[i] = x[Base::kPosition + i] - delay * x[Base::kVelocity + i] + before[i];
    }
  }

  // Attitude as stamped: q_E_M, w x y z, rotated back over the delay (first order in the delay).
  template <class T>
  static Vec4<T> Attitude(const T* x) {
    const Vec4<T> q(x[0], x[1], x[2], x[3]);
    const T half = T(-0.5) * x[kPoseDelay];
    return q + TimesPure(q, Scaled(half, Base::Vector(x, Base::kRate)));
  }

 private:
  template <class T>
  static Vec3<T> Part(const T* v, int index) {
    return Vec3<T>(v[index], v[index + 1], v[index + 2]);
  }
  template <class T>
  static Vec3<T> Times(const T& factor, const Eigen::Vector3d& v) {
    return Vec3<T>(factor * T(v[0]), factor * T(v[1]), factor * T(v[2]));
  }
  // `squared`: by rotor, rad^2/s^2.
  template <class Squared>
  Base::RotorSums<double> SumSquared(double t, const Squared& squared) const {
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), lever = force, reaction = force;
    for (int i = 0; i < num_rotors(); ++i) {
      const Rotor& rotor = base_.rotors()[i];
      const double u = squared(i);
      const Eigen::Vector3d axis = tilt_ * rotor.axis;
      const Eigen::Vector3d thrust = rotor.k_f * u * effects_.ThrustFactor(i, t) * axis;
      force += thrust;
      lever += rotor.position.cross(thrust);
      reaction += rotor.spin * rotor.k_m * u * axis;
    }
    return {force, lever, reaction};
  }
  template <class T>
  void AddTerms(const T* x, const Vec3<T>& v_B, const T& thrust, double t,
                BodyAcceleration<T>* acceleration) const {
    if (effects_.terms.empty()) return;
    const TermState<T> state = TermStateOf(x, v_B, thrust, t);
    acceleration->force += SumInBody(effects_.terms, TermOn::kForce, state);
    acceleration->turn += SumInBody(effects_.terms, TermOn::kTurn, state);
  }
  template <class T>
  void AddMotors(const T* x, const RotorInput& input, const InputSums& over, const T& ground,
                 Base::RotorSums<T>* sums) const {
    for (int j = 0; j < kMotorUnknowns; ++j) {
      const T offset = x[kMotors + j] - T(input.motors[j]);
      const Base::RotorSums<double>& slope = over.slopes[j];
      sums->force += Times(T(ground * offset), slope.force);
      sums->lever += Times(T(ground * offset), slope.lever);
      sums->reaction += Times(offset, slope.reaction);
    }
  }
  // Air velocity in body axes, m/s, without wind.
  template <class T>
  static Vec3<T> AirSpeed(const T* x) {
    const Vec4<T> back = Conjugate(Vec4<T>(x[0], x[1], x[2], x[3]));
    return RotateByUnit(back, Base::Vector(x, Base::kVelocity));
  }
  // Specific force of the air on body and rotors beyond thrust, in body axes.
  template <class T>
  Vec3<T> AirForce(const T* x, const RotorAirFlow<T>& air) const {
    const Vec3<T>& v_B = air.v_B;
    Vec3<T> force(x[kDrag] * v_B[0], x[kDrag + 1] * v_B[1],
                  (x[kDrag + 2] - T(air.speed_sum) * x[kInflow]) * v_B[2]);
    RotorEffects::AddTo(&force, effects_.forces, air);
    return force;
  }

  // Sum of spin times value times axis over the rotors.
  Eigen::Vector3d SumAlongAxes(const std::vector<double>& values) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < values.size(); ++i) {
      sum += base_.rotors()[i].spin * values[i] * (tilt_ * base_.rotors()[i].axis);
    }
    return sum;
  }
  // Moment on the body by rotors that speed up, and by the turn of their angular momentum, N m. A
  // rotor of spin +1 turns about the opposite of its axis.
  template <class T>
  static Vec3<T> RotorReaction(const T* x, const InputSums& over) {
    const Vec3<T> turned =
        Cross(Base::Vector(x, Base::kRate), Vec3<T>(over.momentum.template cast<T>()));
    return Scaled(x[kRotorInertia], Vec3<T>(over.reaction.template cast<T>() + turned));
  }
  // Angular acceleration by the air: a hub that rises meets more inflow, which brakes the turn; one
  // that moves sideways flaps its blades, and drag acts off the centre of mass.
  template <class T>
  static Vec3<T> AirTurn(const T* x, const RotorAirFlow<T>& air) {
    const T* damping = x + kDamping;
    const T* w = x + Base::kRate;
    return Vec3<T>(damping[0] * w[0] + x[kSpeedMoment] * air.v_B[1],
                   damping[1] * w[1] + x[kSpeedMoment + 1] * air.v_B[0], damping[2] * w[2]);
  }

  Base base_;
  RotorEffects effects_;
  Eigen::Matrix3d tilt_;
};

}  // namespace trueline
