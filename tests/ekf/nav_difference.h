// The error between two states of the filter.
#pragma once

#include <cmath>

#include "cost_functions/models/rotation.h"
#include "problems/ekf/ekf.h"

namespace trueline {

inline Eigen::Vector3d WrappedDifference(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return (to - from).unaryExpr([](double angle) { return std::remainder(angle, 2.0 * M_PI); });
}

// Moved(form, from, Difference(form, from, to)) == to.
inline Vector15d Difference(AttitudeForm form, const NavState& from, const NavState& to) {
  Vector15d error;
  error << to.motion.p - from.motion.p, to.motion.v - from.motion.v, Eigen::Vector3d::Zero(),
      to.bias.accel - from.bias.accel, to.bias.gyro - from.bias.gyro;
  if (form == AttitudeForm::kEuler) {
    error.segment<3>(6) = WrappedDifference(EulerFromQuaternion(from.motion.q_E_I),
                                            EulerFromQuaternion(to.motion.q_E_I));
  } else {
    const Eigen::AngleAxisd turn(from.motion.q_E_I.conjugate() * to.motion.q_E_I);
    error.segment<3>(6) = std::remainder(turn.angle(), 2.0 * M_PI) * turn.axis();
  }
  return error;
}

}  // namespace trueline
