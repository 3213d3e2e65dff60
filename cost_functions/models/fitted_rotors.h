// The rotor-driven model (rotor_aero_model.h) as a function of numbers that a fit moves, for data
// that hold motion and rotor speeds but no state of the estimators: the public benchmarks of
// prediction. Body axes are forward-left-up there, forward-right-down in the model.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "cost_functions/models/rotor_aero_model.h"

namespace trueline {

// A number of a fit.
struct FittedNumber {
  std::string name, unit, about;
  double start = 0.0;
  double typical = 1.0;  // its unit in the solver
  bool free = false;
};

// All numbers, from the solver's: those that are free, in their units. The others stay at `values`.
class FreeNumbers {
 public:
  FreeNumbers(const std::vector<FittedNumber>& numbers, std::vector<double> values)
      : values_(std::move(values)) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (numbers[i].free) free_.push_back({i, numbers[i].typical});
    }
  }
  int count() const { return static_cast<int>(free_.size()); }

  template <class T>
  std::vector<T> At(const T* x) const {
    std::vector<T> numbers(values_.begin(), values_.end());
    for (std::size_t i = 0; i < free_.size(); ++i) {
      numbers[free_[i].index] = x[i] * T(free_[i].unit);
    }
    return numbers;
  }
  // The solver's numbers at `values`.
  std::vector<double> Start() const {
    std::vector<double> x;
    for (const Free& f : free_) x.push_back(values_[f.index] / f.unit);
    return x;
  }
  // Standard deviations of all from those of the solver's; zero for held ones.
  std::vector<double> Spread(const Eigen::VectorXd& of_free) const {
    std::vector<double> all(values_.size(), 0.0);
    for (int i = 0; i < count(); ++i) all[free_[i].index] = of_free[i] * free_[i].unit;
    return all;
  }

 private:
  struct Free {
    std::size_t index;
    double unit;
  };
  std::vector<double> values_;
  std::vector<Free> free_;
};

class FittedRotors {
 public:
  using Model = RotorAeroModel;
  using Base = RotorDrivenModel;
  // Of a constant among the numbers.
  static constexpr int NumberOf(int state) { return state - Model::kMoving; }

  // `effects`: each at size 1, forces and terms; the acceleration is linear in their sizes.
  FittedRotors(std::vector<Rotor> rotors, double gravity, std::vector<RotorEffects> effects)
      : model_(std::move(rotors), gravity), effects_(std::move(effects)) {}

  double gravity() const { return model_.base().gravity(); }

  // Specific force [m/s^2] and angular acceleration [rad/s^2]. `c`: the model's constants, then the
  // sizes; `v`: of the centre of mass through the air [m/s]; `w`: body rate [rad/s]; all in body
  // axes.
  template <class T>
  Model::BodyAcceleration<T> At(const T* c, const Vec3<T>& v, const Vec3<T>& w,
                                const RotorInput& rotors) const {
    std::array<T, Model::kStates> x;
    x.fill(T(0.0));
    x[Base::kAttitude] = T(1.0);
    const Vec3<T> v_B = Turned(v), w_B = Turned(w);
    for (int i = 0; i < 3; ++i) {
      x[Base::kVelocity + i] = v_B[i];
      x[Base::kRate + i] = w_B[i];
    }
    std::copy_n(c, Model::kConstants, x.begin() + Model::kMoving);
    Model::BodyAcceleration<T> sum = model_.BodyAccelerationOf(x.data(), rotors);
    const T thrust = -sum.force[2];
    for (std::size_t i = 0; i < effects_.size(); ++i) {
      const Model::BodyAcceleration<T> part = Part(effects_[i], x.data(), thrust, rotors);
      const T& size = c[Model::kConstants + static_cast<int>(i)];
      for (int a = 0; a < 3; ++a) {
        sum.force[a] += size * part.force[a];
        sum.turn[a] += size * part.turn[a];
      }
    }
    return {Turned(sum.force), Turned(sum.turn)};
  }

  // Deceleration along body x over a slow air speed [1/s].
  template <class T>
  T LinearDrag(const T* c, const RotorInput& rotors) const {
    constexpr double kSlow = 1e-3;  // m/s
    T drag = -c[NumberOf(Model::kDrag)];
    for (std::size_t i = 0; i < effects_.size(); ++i) {
      const auto force = [&](double speed) {
        std::array<double, Model::kStates> x = {1.0};
        x[Base::kVelocity] = speed;
        return Part(effects_[i], x.data(), gravity(), rotors).force[0];
      };
      const double slope = (force(-kSlow) - force(kSlow)) / (2.0 * kSlow);
      drag += c[Model::kConstants + static_cast<int>(i)] * T(slope);
    }
    return drag;
  }

 private:
  // Between forward-left-up and forward-right-down.
  template <class T>
  static Vec3<T> Turned(const Vec3<T>& v) {
    return Vec3<T>(v[0], -v[1], -v[2]);
  }
  template <class T>
  static Model::BodyAcceleration<T> Part(const RotorEffects& effect, const T* x, const T& thrust,
                                         const RotorInput& rotors) {
    const Vec3<T> v = Base::Vector(x, Base::kVelocity);
    const auto state = Model::TermStateOf(x, v, thrust, rotors.t);
    Model::BodyAcceleration<T> part{SumInBody(effect.terms, TermOn::kForce, state),
                                    SumInBody(effect.terms, TermOn::kTurn, state)};
    RotorEffects::AddTo(&part.force, effect.forces, RotorAirFlow<T>{v, Model::SumOf(rotors)});
    return part;
  }

  Model model_;
  std::vector<RotorEffects> effects_;
};

}  // namespace trueline
