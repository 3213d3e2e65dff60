// The pose sensor's reading as a residual, shared by filter and batch.
#pragma once

#include "problems/rotor/rotor_data.h"
#include "problems/rotor/rotor_noise.h"
#include "problems/rotor/rotor_state.h"

namespace trueline {

// Prediction less measurement, in sigmas: position (3 rows, m) and, if `attitude`, the rotation 2
// vec(q_measured^* q) in body axes (3 rows, rad). `x`: kStates numbers.
template <class T>
void PoseError(const RotorPose& pose, bool attitude, const RotorNoise& noise, const T* x,
               T* error) {
  RotorAeroModel::Position(x, error);
  for (int i = 0; i < 3; ++i) error[i] = (error[i] - pose.p_E[i]) / noise.position;
  if (!attitude) return;
  const Vec4<T> back(T(pose.q_E_P.w()), T(-pose.q_E_P.x()), T(-pose.q_E_P.y()), T(-pose.q_E_P.z()));
  const Vec4<T> turn = HamiltonProduct(back, RotorAeroModel::Attitude(x));
  const T twice(turn[0] < T(0.0) ? -2.0 : 2.0);
  for (int i = 0; i < 3; ++i) error[3 + i] = twice * turn[1 + i] / noise.attitude;
}

}  // namespace trueline
