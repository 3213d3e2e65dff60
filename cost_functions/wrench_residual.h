// Force and moment balance of one row of a flight: measured specific force and angular acceleration
// against the rotor-driven model.
#pragma once

#include "cost_functions/models/fitted_rotors.h"

namespace trueline {

// What is measured at a row, in body axes (forward-left-up).
struct WrenchRow {
  Eigen::Vector3d v, w;                // m/s, rad/s
  Eigen::Vector3d specific_force, dw;  // m/s^2 at the measured point, rad/s^2
  RotorInput rotors;
};

// Force [N]: m (a - dw x r - w x (w x r)) - F, the measured point at r = r_BI - r_BM. Moment [N m]:
// I dw + w x I w - M. The moment's error is one of the rotors' and the air's moment (gusts, wakes,
// errors of the speeds), not of the angular acceleration, which is measured well: with the error on
// the other side, inertia would come out too large wherever the controller cancels disturbances
// (regression dilution).
class WrenchResidual {
 public:
  struct Options {
    Eigen::Vector3d force_sigma{0.1, 0.1, 0.3};    // N
    Eigen::Vector3d moment_sigma{0.2, 0.2, 0.02};  // N m
  };
  template <class T>
  struct Wrench {
    Vec3<T> force, moment;  // N at the measured point, N m about the centre of mass
  };

  WrenchResidual(const FittedRotors& rotors, const FreeNumbers& numbers, const WrenchRow& row,
                 const Options& options)
      : rotors_(rotors), numbers_(numbers), row_(row), options_(options) {}

  // I dw + w x I w. `inertia`: its diagonal, 3 numbers.
  template <class T>
  static Vec3<T> Moment(const T* inertia, const Vec3<T>& dw, const Vec3<T>& w) {
    return ScaledBy(inertia, dw) + Cross(w, ScaledBy(inertia, w));
  }
  // By the model.
  template <class T>
  static Wrench<T> Predict(const FittedRotors& rotors, const WrenchRow& row, const T* c) {
    const Vec3<T> v = row.v.cast<T>(), w = row.w.cast<T>(), dw = row.dw.cast<T>();
    const auto model = rotors.At(c, v, w, row.rotors);
    const T* r_BM = c + FittedRotors::NumberOf(RotorDrivenModel::kCentre);
    const T* r_BI = c + FittedRotors::NumberOf(RotorDrivenModel::kImuArm);
    const Vec3<T> arm(r_BI[0] - r_BM[0], r_BM[1] - r_BI[1], r_BM[2] - r_BI[2]);
    const Vec3<T> extra = Cross(dw, arm) + Cross(w, Vec3<T>(Cross(w, arm)));
    const T& mass = c[FittedRotors::NumberOf(RotorDrivenModel::kMass)];
    return {Scaled(mass, Vec3<T>(model.force + extra)), Moment(InertiaIn(c), model.turn, w)};
  }

  // x: the free numbers, one block.
  template <class T>
  bool operator()(T const* const* x, T* residuals) const {
    const std::vector<T> c = numbers_.At(x[0]);
    const Wrench<T> wrench = Predict(rotors_, row_, c.data());
    const Vec3<T> turned =
        Moment(InertiaIn(c.data()), Vec3<T>(row_.dw.cast<T>()), Vec3<T>(row_.w.cast<T>()));
    for (int i = 0; i < 3; ++i) {
      const T force =
          c[FittedRotors::NumberOf(RotorDrivenModel::kMass)] * T(row_.specific_force[i]);
      residuals[i] = (wrench.force[i] - force) / T(options_.force_sigma[i]);
      residuals[3 + i] = (wrench.moment[i] - turned[i]) / T(options_.moment_sigma[i]);
    }
    return true;
  }

 private:
  // Of the numbers of FittedRotors.
  template <class T>
  static const T* InertiaIn(const T* c) {
    return c + FittedRotors::NumberOf(RotorDrivenModel::kInertia);
  }

  const FittedRotors& rotors_;
  const FreeNumbers& numbers_;
  const WrenchRow& row_;
  const Options& options_;
};

}  // namespace trueline
