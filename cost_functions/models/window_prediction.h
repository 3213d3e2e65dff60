// Half a second of flight predicted from one state and the rotor speeds that follow: the
// rotor-driven model (fitted_rotors.h), the processes of a stabilised attitude
// (stabilised_process.h), and the errors of the state that is given (room_path.h).
#pragma once

#include <array>
#include <vector>

#include "cost_functions/models/fitted_rotors.h"
#include "cost_functions/models/room_path.h"
#include "cost_functions/models/stabilised_process.h"

namespace trueline {

// Errors of a logged state, and how the flight is held.
inline const FittedNumber kStateNumbers[] = {
    {"g_v", "1",
     "excess of the logged horizontal velocity over the change of position, fast motion"},
    {"t_v", "s", "time beyond which the logged velocity follows the position"},
    {"t_p", "s", "lag of the logged velocity behind the position"},
    {"s_w", "1", "roll and pitch change by this share of the logged rate"},
    {"t_q", "s", "lag of the logged attitude behind the logged rate"},
    {"b_w", "rad/m", "rate of roll and pitch that brakes the horizontal speed, over that speed"},
};

// What is given: z-up world, forward-left-up body.
struct PredictionWindow {
  static constexpr int kSteps = StabilisedProcess::kSteps;
  Eigen::Vector3d p, v;                   // m, m/s, in the world
  Eigen::Vector4d q;                      // body to world, w x y z
  Eigen::Vector3d w;                      // rad/s, in the body
  std::array<RotorInput, kSteps> rotors;  // mean over each step
};

template <class T>
struct PredictedState {
  Vec3<T> p, v;
  Vec4<T> q;
  Vec3<T> w;
};
template <class T>
using PredictedStates = std::array<PredictedState<T>, PredictionWindow::kSteps>;

class WindowPrediction {
 public:
  // From kVelocity on: FusedVelocityNumbers, which act by the FusedVelocity that is given. From
  // kRotors on: those of FittedRotors.
  static constexpr int kVelocity = 0, kRateShare = kVelocity + 3, kAttitudeLag = kRateShare + 1,
                       kBraking = kAttitudeLag + 1, kRotors = kBraking + 1;
  enum ProcessIndex { kLevel, kHeading, kProcesses };  // of roll and pitch, of heading
  using Process = std::array<StabilisedProcess, kProcesses>;
  // What the processes observe, by axis.
  template <class T>
  using Observed = std::array<std::vector<T>, 3>;

  WindowPrediction(const FittedRotors& rotors, const Process& process,
                   const FusedVelocity& velocity, const FastVelocity& fast)
      : rotors_(rotors), process_(process), velocity_(velocity), fast_(fast) {}

  // States at the ends of the steps. `c`: the numbers. Rates, motion and the fast part of the
  // velocity depend on each other: they are computed in turns, from first guesses. `observed`: what
  // the processes have seen; may be null.
  template <class T>
  void Predict(const T* c, const PredictionWindow& window, PredictedStates<T>* states,
               Observed<T>* observed = nullptr) const {
    constexpr int kTurns = 2;
    constexpr double kDecay = 0.2, kFast = 0.8;  // first guesses: s; share of the velocity
    for (int k = 0; k < kSteps; ++k) {
      (*states)[k].w = Constant<T>(std::exp(-(k + 1) * kStep / kDecay) * window.w);
    }
    FastVelocity::Axes<T> fast;
    for (int a = 0; a < 2; ++a) fast[a].fill(T(kFast * window.v[a]));
    Observed<T> net;
    for (int turn = 0; turn < kTurns; ++turn) {
      Move(c, window, fast, states, &net);
      fast = fast_.Expect({window.v[0], window.v[1]}, LevelVelocities(*states));
      ExpectRates(c, window, net, states);
    }
    Move(c, window, fast, states, &net);
    CorrectPositions(window, states);
    if (observed != nullptr) *observed = net;
  }

  // Rotation vector of the tilt in body axes, and heading [rad].
  static Eigen::Vector3d AttitudeAngles(const Eigen::Vector4d& q) {
    const Eigen::Vector3d up = RotateByUnit(Conjugate(q), Eigen::Vector3d(0.0, 0.0, 1.0));
    const double across = std::hypot(up.x(), up.y());
    const double scale = across > 1e-9 ? std::atan2(across, up.z()) / across : 1.0;
    // rad: a vehicle flown at another one is not held near zero.
    constexpr double kHeldHeading = 1.0;
    const double heading = std::remainder(2.0 * std::atan2(q[3], q[0]), 2.0 * M_PI);
    return {scale * up.y(), -scale * up.x(), std::abs(heading) < kHeldHeading ? heading : 0.0};
  }
  // Horizontal velocity along which a roll, and a pitch, accelerates; nothing for the heading
  // [m/s].
  static Eigen::Vector3d TiltedSpeeds(const PredictionWindow& window) {
    const Eigen::Vector3d level(window.v.x(), window.v.y(), 0.0);
    const Eigen::Vector3d in_body = RotateByUnit(Conjugate(window.q), level);
    return {-in_body.y(), in_body.x(), 0.0};
  }
  // A flight within a room brakes harder than the processes expect: the rate that is missing at
  // the end of `step`, over the number kBraking [m/s]. `speeds`: TiltedSpeeds().
  static Eigen::Vector3d Braking(const Eigen::Vector3d& speeds, int step) {
    constexpr double kTime = 0.25;  // s
    return (std::exp(-(step + 1) * kStep / kTime) - 1.0) * speeds;
  }
  // By axis.
  template <class T>
  static std::array<std::array<T, PredictionWindow::kSteps>, 2> LevelVelocities(
      const PredictedStates<T>& states) {
    std::array<std::array<T, PredictionWindow::kSteps>, 2> v;
    for (int a = 0; a < 2; ++a) {
      for (int k = 0; k < PredictionWindow::kSteps; ++k) v[a][k] = states[k].v[a];
    }
    return v;
  }

 private:
  static constexpr int kSteps = PredictionWindow::kSteps;
  static constexpr double kStep = StabilisedProcess::kStep;

  template <class T>
  static Vec3<T> Constant(const Eigen::Vector3d& v) {
    return Vec3<T>(T(v[0]), T(v[1]), T(v[2]));
  }
  template <class T>
  static Vec3<T> Sum(const Vec3<T>& a, const T& factor, const Vec3<T>& b) {
    return Vec3<T>(a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]);
  }
  // q turned by the rotation vector r in body axes, by the exponential's series to fourth order.
  template <class T>
  static Vec4<T> Turned(const Vec4<T>& q, const Vec3<T>& r) {
    const T s = (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]) * T(0.25);
    const T sine = T(0.5) * (T(1.0) - s / T(6.0));
    const Vec4<T> turn(T(1.0) - s * (T(0.5) - s / T(24.0)), sine * r[0], sine * r[1], sine * r[2]);
    return HamiltonProduct(q, turn);
  }

  // What the processes observe of the start; the moments are to come.
  template <class T>
  Observed<T> ObservedStart(const PredictionWindow& window) const {
    const Eigen::Vector3d angles = AttitudeAngles(window.q);
    const Eigen::Vector3d speeds = TiltedSpeeds(window) / rotors_.gravity();
    Observed<T> observed;
    for (int i = 0; i < 3; ++i) {
      observed[i].resize(StabilisedProcess::kObserved);
      observed[i].front() = T(angles[i]);
      observed[i][1] = T(window.w[i]);
      observed[i].back() = T(speeds[i]);
    }
    return observed;
  }
  // Moves position, velocity and attitude under the rates in `states`; collects the model's net
  // angular accelerations. Midpoint steps; the force at a step's middle uses the velocity that the
  // previous step's acceleration leads to.
  template <class T>
  void Move(const T* c, const PredictionWindow& window, const FastVelocity::Axes<T>& fast,
            PredictedStates<T>* states, Observed<T>* net) const {
    const T half(0.5 * kStep), step(kStep);
    const double gravity = rotors_.gravity();
    Vec3<T> p = Constant<T>(window.p), v = Constant<T>(window.v), w = Constant<T>(window.w);
    Vec4<T> q(T(window.q[0]), T(window.q[1]), T(window.q[2]), T(window.q[3]));
    // The drag of the velocity's slow part is not in the logged tilt (room_path.h).
    const auto acceleration = [&](const Vec4<T>& at, const Vec3<T>& force, const T& drag,
                                  const Vec3<T>& slow) {
      Vec3<T> a = RotateByUnit(at, force);
      for (int i = 0; i < 3; ++i) a[i] += drag * slow[i];
      a[2] -= T(gravity);
      return a;
    };
    const Vec3<T> v0 = RotateByUnit(Conjugate(q), v);
    const Vec3<T> slow0(v[0] - fast[0][0], v[1] - fast[1][0], T(0.0));
    const T* of_rotors = c + kRotors;
    Vec3<T> a = acceleration(q, rotors_.At(of_rotors, v0, w, window.rotors[0]).force,
                             rotors_.LinearDrag(of_rotors, window.rotors[0]), slow0);
    *net = ObservedStart<T>(window);
    for (int k = 0; k < kSteps; ++k) {
      PredictedState<T>& state = (*states)[k];
      const T drag = rotors_.LinearDrag(of_rotors, window.rotors[k]);
      const Vec3<T> fast_mid(T(0.5) * (fast[0][k] + fast[0][k + 1]),
                             T(0.5) * (fast[1][k] + fast[1][k + 1]), T(0.0));
      // About this the logged attitude falls behind the rates.
      const Vec3<T> behind = RotateByUnit(Conjugate(q), Vec3<T>(fast_mid[1], -fast_mid[0], T(0.0)));
      Vec3<T> w_mid, turn;
      for (int i = 0; i < 3; ++i) {
        w_mid[i] = T(0.5) * (w[i] + state.w[i]);
        const T rate = w_mid[i] - c[kAttitudeLag] * (state.w[i] - w[i]) / step;
        const T slip = drag / T(gravity * fast_.time()) * behind[i];
        turn[i] = step * (i < 2 ? c[kRateShare] * rate + slip : rate);
      }
      const Vec4<T> q_mid = Turned(q, Scaled(T(0.5), turn));
      const Vec3<T> v_world = Sum(v, half, a), v_mid = RotateByUnit(Conjugate(q_mid), v_world);
      const auto pushed = rotors_.At(of_rotors, v_mid, w_mid, window.rotors[k]);
      for (int i = 0; i < 3; ++i) (*net)[i][k + 2] = pushed.turn[i];
      const Vec3<T> slow(v_world[0] - fast_mid[0], v_world[1] - fast_mid[1], T(0.0));
      a = acceleration(q_mid, pushed.force, drag, slow);
      const Vec3<T> v_next = Sum(v, step, a);
      for (int i = 0; i < 3; ++i) p[i] += half * (v[i] + v_next[i]);
      v = v_next;
      q = Turned(q, turn);
      w = state.w;
      state.p = p;
      state.v = v;
      state.q = q;
    }
  }
  template <class T>
  void ExpectRates(const T* c, const PredictionWindow& window, const Observed<T>& net,
                   PredictedStates<T>* states) const {
    std::vector<std::vector<T>> level, heading;
    process_[kLevel].Expect<T>({net[0], net[1]}, &level);
    process_[kHeading].Expect<T>({net[2]}, &heading);
    const Eigen::Vector3d speeds = TiltedSpeeds(window);
    for (int k = 0; k < kSteps; ++k) {
      const Vec3<T> braking = Constant<T>(Braking(speeds, k));
      (*states)[k].w = Sum(Vec3<T>(level[0][k], level[1][k], heading[0][k]), c[kBraking], braking);
    }
  }
  template <class T>
  void CorrectPositions(const PredictionWindow& window, PredictedStates<T>* states) const {
    const auto correction =
        velocity_.Correction({window.v[0], window.v[1]}, LevelVelocities(*states));
    for (int a = 0; a < 2; ++a) {
      for (int k = 0; k < kSteps; ++k) (*states)[k].p[a] += correction[a][k];
    }
  }

  const FittedRotors& rotors_;
  const Process& process_;
  const FusedVelocity& velocity_;
  const FastVelocity& fast_;
};

}  // namespace trueline
