// The model of Li et al. 2019 as a System (see lie_derivatives.h): position, velocity and the
// parameters of eq. 16. Inputs are the nine numbers of the AHRS attitude R_Ep_I (row by row) and
// the thrust-axis acceleration; the output is position.
#pragma once

#include <ceres/jet.h>

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "cost_functions/models/imu_driven_model.h"
#include "problems/observability/rank.h"

namespace trueline {

class ImuDrivenSystem {
 public:
  static constexpr int kPosition = 0, kVelocity = 3, kParameters = 6;
  static constexpr int kMoving = 6, kStates = kMoving + kMotionSize, kErrors = kStates;
  // Drag (x, y) at which flights are assessed, 1/s. It differs between the axes: with equal drag a
  // rotation of the IMU about z changes nothing, and psi_I_B would be unobservable.
  static constexpr double kTypicalDrag[] = {-0.55, -0.45};

  // `fix_rate` [Hz] and `sigma_fix` [m] of position fixes, each axis.
  explicit ImuDrivenSystem(double gravity = 9.81, double fix_rate = 30.0, double sigma_fix = 0.1)
      : gravity_(gravity), fix_rate_(fix_rate), sigma_fix_(sigma_fix) {
    for (const char* name : {"p_x", "p_y", "p_z"}) errors_.push_back({name, "m", true, 0.1});
    for (const char* name : {"v_x", "v_y", "v_z"}) errors_.push_back({name, "m/s", true, 0.1});
    for (int i = 0; i < kMotionSize; ++i) {
      errors_.push_back({kTheta[i].name, kTheta[i].unit, false, 0.1});
    }
  }

  // A state at rest, with typical drag.
  static std::vector<double> Typical() {
    std::vector<double> x(kStates, 0.0);
    for (int i = 0; i < 2; ++i) x[kParameters + kDragInTheta + i] = kTypicalDrag[i];
    return x;
  }

  const std::vector<StateInfo>& errors() const { return errors_; }
  std::string SensorNames() const { return "position"; }
  int num_outputs() const { return 3; }
  std::vector<double> OutputWeights() const {
    return std::vector<double>(3, std::sqrt(fix_rate_) / sigma_fix_);
  }
  static int CountStates(const std::vector<int>& states) { return static_cast<int>(states.size()); }
  std::vector<int> AllStates() const {
    std::vector<int> all(kErrors);
    std::iota(all.begin(), all.end(), 0);
    return all;
  }

  template <class T>
  void Derivative(const T* x, const T* u, T* dx) const {
    const ImuDrivenModel<T> model(ImuDrivenParameters<T>::FromArray(x + kParameters), gravity_);
    DriveOf<T> drive;
    for (int i = 0; i < 9; ++i) drive.R_Ep_I(i / 3, i % 3) = u[i];
    drive.a_z = u[9];
    const Vector3<T> v(x[kVelocity], x[kVelocity + 1], x[kVelocity + 2]);
    const Vector3<T> a = model.AccelerationBy(drive, v);
    for (int i = 0; i < 3; ++i) {
      dx[kPosition + i] = v[i];
      dx[kVelocity + i] = a[i];
    }
  }

  template <class T>
  void Output(const T* x, const T*, T* y) const {
    for (int i = 0; i < 3; ++i) y[i] = x[kPosition + i];
  }

  template <class C>
  void Seed(const C* x, ceres::Jet<C, kErrors>* out) const {
    for (int i = 0; i < kStates; ++i) out[i] = ceres::Jet<C, kErrors>(x[i], i);
  }
  template <class C>
  void Error(const C*, const C* dx, C* error) const {
    for (int i = 0; i < kStates; ++i) error[i] = dx[i];
  }

 private:
  double gravity_, fix_rate_, sigma_fix_;
  std::vector<StateInfo> errors_;
};

}  // namespace trueline
