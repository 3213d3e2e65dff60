// The residual of a pose sensor's reading on a rotor-driven vehicle (Wuest et al. 2019).
//
//   prediction: position and attitude of the sensor P
//   error:      position less the reading, m; rotation 2 vec(q_read^* q) in body axes, rad
//   weighting:  each divided by its sigma
//   unknowns:   the kStates numbers of the model: motion and constants
#pragma once

#include <Eigen/Geometry>

#include "cost_functions/models/rotor_aero_model.h"

namespace trueline {

struct PoseError {
  Eigen::Vector3d p_E;
  Eigen::Quaterniond q_E_P;
  double position_sigma;  // m
  double attitude_sigma;  // rad

  // 6 rows, or the position's 3.
  template <class T>
  void operator()(const T* x, int rows, T* error) const {
    RotorAeroModel::Position(x, error);
    for (int i = 0; i < 3; ++i) error[i] = (error[i] - p_E[i]) / position_sigma;
    if (rows == 3) return;
    const Vec4<T> back(T(q_E_P.w()), T(-q_E_P.x()), T(-q_E_P.y()), T(-q_E_P.z()));
    const Vec4<T> turn = HamiltonProduct(back, RotorAeroModel::Attitude(x));
    const T twice(turn[0] < T(0.0) ? -2.0 : 2.0);
    for (int i = 0; i < 3; ++i) error[3 + i] = twice * turn[1 + i] / attitude_sigma;
  }
};

}  // namespace trueline
