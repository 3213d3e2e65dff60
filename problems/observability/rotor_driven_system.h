// The rotor-driven model with a set of sensors as a System (see lie_derivatives.h). The error state
// has 33 numbers, with attitude errors in body axes: q = q0 * (1, theta / 2).
#pragma once

#include <ceres/jet.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "cost_functions/models/rotor_constants.h"
#include "cost_functions/models/rotor_driven_model.h"
#include "problems/common/yaml_archive.h"
#include "problems/log/flight_log.h"
#include "problems/observability/rank.h"

namespace trueline {

// The sensors and their noise; sigmas are of one sample.
struct SensorSet {
  bool imu = true;
  bool position = false;
  bool pose = true;
  double imu_rate = 250.0;       // Hz
  double sigma_accel = 2.2;      // m/s^2; 4.84 (m/s^2)^2 in Wuest et al.
  double sigma_gyro = 0.1732;    // rad/s; 0.03 (rad/s)^2
  double pose_rate = 30.0;       // Hz, of position fixes too
  double sigma_position = 0.01;  // m
  double sigma_attitude = 0.01;  // rad
};

class RotorDrivenSystem {
 public:
  using Model = RotorDrivenModel;
  static constexpr int kStates = Model::kStates;
  static constexpr int kMoving = Model::kMoving;
  static constexpr int kErrors = kStates - 1;
  static constexpr int kMovingErrors = kMoving - 1;

  RotorDrivenSystem(Model model, SensorSet sensors)
      : model_(std::move(model)), sensors_(sensors), errors_(MakeErrors()) {}

  const Model& model() const { return model_; }
  const SensorSet& sensors() const { return sensors_; }
  const std::vector<StateInfo>& errors() const { return errors_; }
  std::string SensorNames() const {
    std::string names;
    const auto add = [&](bool there, const char* name) {
      if (there) names += names.empty() ? name : std::string(", ") + name;
    };
    add(sensors_.imu, "imu"), add(sensors_.position, "position"), add(sensors_.pose, "pose");
    return names;
  }
  int num_outputs() const {
    return (sensors_.imu ? 6 : 0) + (sensors_.position ? 3 : 0) + (sensors_.pose ? 7 : 0);
  }

  // Errors whose effect on states and outputs is affine in time: position, velocity, sensor biases.
  static constexpr bool AffineInTime(int error) {
    const bool moved = error >= Model::kPosition - 1 && error < Model::kRate - 1;
    return moved || (error >= Model::kAccelBias - 1 && error < Model::kThrustScale - 1);
  }

  template <class T>
  void Derivative(const T* x, const T* u, T* dx) const {
    model_.Derivative(x, u, dx);
  }

  template <class T>
  void Output(const T* x, const T* u, T* y) const {
    OutputBy(x, model_.ForceAndMoment(x, u), y);
  }
  template <class T>
  void OutputBy(const T* x, const Model::Wrench<T>& wrench, T* y) const {
    if (sensors_.imu) Model::ImuBy(x, wrench, y), y += 6;
    if (sensors_.position) Model::Position(x, y), y += 3;
    if (sensors_.pose) Model::Position(x, y), Model::Attitude(x, y + 3);
  }

  // sqrt(rate) / sigma of each output, so that |weight * y|^2 dt is information. A quaternion
  // changes by half the angle, so its four numbers together weigh an attitude error once.
  std::vector<double> OutputWeights() const {
    const SensorSet& s = sensors_;
    std::vector<double> weights;
    const auto add = [&](int count, double rate, double sigma) {
      weights.insert(weights.end(), count, std::sqrt(rate) / sigma);
    };
    if (s.imu) add(3, s.imu_rate, s.sigma_accel), add(3, s.imu_rate, s.sigma_gyro);
    if (s.position) add(3, s.pose_rate, s.sigma_position);
    if (s.pose) add(3, s.pose_rate, s.sigma_position), add(4, s.pose_rate, 0.5 * s.sigma_attitude);
    return weights;
  }

  template <class C>
  void Seed(const C* x, ceres::Jet<C, kErrors>* out) const {
    using Jet = ceres::Jet<C, kErrors>;
    const C half(0.5);
    const Vec4<C> q(x[0], x[1], x[2], x[3]);
    for (int i = 0; i < 4; ++i) out[i] = Jet(q[i]);
    for (int axis = 0; axis < 3; ++axis) {
      Vec3<C> turn(C(0.0), C(0.0), C(0.0));
      turn[axis] = half;
      const Vec4<C> column = TimesPure(q, turn);
      for (int i = 0; i < 4; ++i) out[i].v[axis] = column[i];
    }
    for (int i = 4; i < kStates; ++i) out[i] = Jet(x[i], i - 1);
  }

  template <class C>
  void Error(const C* x, const C* dx, C* error) const {
    const Vec4<C> q(x[0], x[1], x[2], x[3]), dq(dx[0], dx[1], dx[2], dx[3]);
    const Vec4<C> turn = HamiltonProduct(Conjugate(q), dq);
    for (int i = 0; i < 3; ++i) error[i] = turn[i + 1] + turn[i + 1];
    for (int i = 4; i < kStates; ++i) error[i - 1] = dx[i];
  }

  // Numbers of the state vector for these error states.
  static int CountStates(const std::vector<int>& states) {
    const bool attitude = std::count(states.begin(), states.end(), 0) > 0;
    return static_cast<int>(states.size()) + (attitude ? 1 : 0);
  }

  // The error states of the papers' 31 numbers: all but r_BI_z, k_f and k_m, which are known.
  std::vector<int> PaperStates() const {
    std::vector<int> states;
    for (int i = 0; i < kErrors; ++i) {
      if (i < kMovingErrors || kRotorConstants[i - kMovingErrors].sigma > 0.0) states.push_back(i);
    }
    return states;
  }

 private:
  static std::vector<StateInfo> MakeErrors() {
    std::vector<StateInfo> all;
    const auto add = [&](const std::string& name, const std::string& unit) {
      for (const char* axis : {"x", "y", "z"}) all.push_back({name + axis, unit, true, 0.1});
    };
    add("theta_", "rad"), add("p_", "m"), add("v_", "m/s"), add("w_", "rad/s");
    for (int i = 0; i < kStates - kMoving; ++i) {
      const RotorConstantInfo& info = kRotorConstants[i];
      all.push_back({info.name, info.unit, false, info.typical});
    }
    return all;
  }

  Model model_;
  SensorSet sensors_;
  std::vector<StateInfo> errors_;
};

// The same system with the rotors' sums as inputs instead of squared speeds. The sums do not depend
// on the state: series of them need no gradient and are computed once.
class RotorSumsSystem {
 public:
  using Model = RotorDrivenModel;
  static constexpr int kStates = RotorDrivenSystem::kStates, kMoving = RotorDrivenSystem::kMoving,
                       kErrors = RotorDrivenSystem::kErrors;

  explicit RotorSumsSystem(const RotorDrivenSystem& system) : system_(system) {}

  static constexpr bool AffineInTime(int error) { return RotorDrivenSystem::AffineInTime(error); }
  int num_outputs() const { return system_.num_outputs(); }

  template <class T>
  std::vector<T> Inputs(const std::vector<T>& u) const {
    const auto sums = system_.model().SumsOf(u.data());
    std::vector<T> inputs;
    for (const Vec3<T>& sum : {sums.force, sums.lever, sums.reaction}) {
      for (int i = 0; i < 3; ++i) inputs.push_back(sum[i]);
    }
    return inputs;
  }
  template <class T>
  void Derivative(const T* x, const T* inputs, T* dx) const {
    system_.model().DerivativeBy(x, WrenchBy(x, inputs), dx);
  }
  template <class T>
  void Output(const T* x, const T* inputs, T* y) const {
    system_.OutputBy(x, WrenchBy(x, inputs), y);
  }
  template <class C>
  void Seed(const C* x, ceres::Jet<C, kErrors>* out) const {
    system_.Seed(x, out);
  }
  template <class C>
  void Error(const C* x, const C* dx, C* error) const {
    system_.Error(x, dx, error);
  }

 private:
  template <class T>
  static Model::Wrench<T> WrenchBy(const T* x, const T* inputs) {
    const auto sum = [&](int i) { return Model::Vector(inputs, i); };
    return Model::WrenchOf(x, Model::RotorSums<T>{sum(0), sum(3), sum(6)});
  }

  const RotorDrivenSystem& system_;
};

// Rates [Hz] and sigmas of one sample; every key has a default (those of Wuest et al.).
void Serialize(YamlArchive* a, SensorSet* s);
// Names out of imu, position, pose.
SensorSet WithSensors(SensorSet noise, const std::vector<std::string>& names, const YamlMap& map,
                      const std::string& key);

// Rates as logged; sigmas as for the paper's sensors, but for fixes, which state theirs.
SensorSet SensorsOf(const FlightLog& log);

}  // namespace trueline
