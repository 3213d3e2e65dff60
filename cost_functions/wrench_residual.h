// Force and moment balance of one row of a flight: measured specific force and angular acceleration
// against the rotor-by-rotor model.
#pragma once

#include <ceres/autodiff_cost_function.h>

#include "cost_functions/models/rotor_air.h"

namespace trueline {

// What is measured at a row, in body axes (forward-left-up).
struct WrenchRow {
  double t = 0.0;                      // s
  Eigen::Vector3d v, w;                // m/s, rad/s
  Eigen::Vector3d specific_force, dw;  // m/s^2 at the measured point, rad/s^2
  std::array<RotorMotion, 4> rotors;
};

// The arm from the centre of mass to the point whose motion was measured.
inline constexpr RotorAirInfo kMeasuredPoint[] = {
    {"r_m_x", "m", "measured point ahead of the centre of mass"},
    {"r_m_y", "m", "measured point left of it"},
    {"r_m_z", "m", "measured point above it"},
};

// Force [N]: m (a - dw x r - w x (w x r)) - F. Moment [N m]: I dw + w x I w - M. The moment's error
// is one of the rotors' and the air's moment (gusts, wakes, errors of the speeds), not of the
// angular acceleration, which is measured well: with the error on the other side, inertia would
// come out too large wherever the controller cancels disturbances (regression dilution).
class WrenchResidual {
 public:
  static constexpr int kPoint = RotorAir::kCount, kCount = kPoint + 3;
  struct Options {
    Eigen::Vector3d force_sigma{0.1, 0.1, 0.3};    // N
    Eigen::Vector3d moment_sigma{0.2, 0.2, 0.02};  // N m
    std::array<double, kCount> units = {};         // the solver's numbers are multiples of these
  };

  WrenchResidual(const RotorAir& air, const WrenchRow& row, const Options& options)
      : air_(air), row_(row), options_(options) {}

  // Force [N] at the measured point and net moment of the model; c: kCount numbers.
  template <class T>
  static RotorAirWrench<T> Predict(const RotorAir& air, const WrenchRow& row, const T* c) {
    const Vec3<T> v = row.v.cast<T>(), w = row.w.cast<T>(), dw = row.dw.cast<T>();
    RotorAirWrench<T> wrench = air.WrenchOn(c, v, v, w, row.rotors.data());
    const Vec3<T> arm(c[kPoint], c[kPoint + 1], c[kPoint + 2]);
    const Vec3<T> extra = Cross(dw, arm) + Cross(w, Vec3<T>(Cross(w, arm)));
    for (int i = 0; i < 3; ++i) wrench.force[i] += T(air.vehicle().mass) * extra[i];
    return wrench;
  }

  template <class T>
  bool operator()(const T* x, T* residuals) const {
    std::array<T, kCount> c;
    for (int i = 0; i < kCount; ++i) c[i] = x[i] * T(options_.units[i]);
    const RotorAirWrench<T> wrench = Predict(air_, row_, c.data());
    const T* inertia = c.data() + RotorAir::kInertia;
    const Vec3<T> w = row_.w.cast<T>();
    const Vec3<T> momentum(inertia[0] * w[0], inertia[1] * w[1], inertia[2] * w[2]);
    const Vec3<T> gyroscopic = Cross(w, momentum);
    for (int i = 0; i < 3; ++i) {
      const T force = T(air_.vehicle().mass * row_.specific_force[i]);
      residuals[i] = (wrench.force[i] - force) / T(options_.force_sigma[i]);
      const T turned = inertia[i] * T(row_.dw[i]) + gyroscopic[i];
      residuals[3 + i] = (wrench.moment[i] - turned) / T(options_.moment_sigma[i]);
    }
    return true;
  }

 private:
  const RotorAir& air_;
  const WrenchRow& row_;
  const Options& options_;
};

}  // namespace trueline
