// The moving part of the IMU-driven model.
#pragma once

#include "cost_functions/models/imu_driven_model.h"

namespace trueline {

template <typename T>
struct MotionState {
  Vector3<T> p = Vector3<T>::Zero();  // m
  Vector3<T> v = Vector3<T>::Zero();  // m/s
};

}  // namespace trueline
