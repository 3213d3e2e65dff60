// A plain integrator, the reference for MotionBlock.
#pragma once

#include "cost_functions/models/imu_driven_model.h"
#include "cost_functions/models/motion_block.h"

namespace trueline {

// One explicit midpoint step over `dt` seconds, in E. `drive` is taken at the middle of the step,
// which makes the step second-order also for irregular steps.
template <typename T>
void MidpointStep(const ImuDrivenModel<T>& model, const Drive& drive, double dt,
                  MotionState<T>* state) {
  const Matrix3<T> R_E_B = model.BodyToEarth(drive.R_Ep_I);
  const auto acceleration = [&](const Vector3<T>& v) -> Vector3<T> {
    return R_E_B * model.SpecificForce(drive.a_z, R_E_B.transpose() * v) + model.g_E();
  };
  const Vector3<T> v_mid = state->v + acceleration(state->v) * T(0.5 * dt);
  const Vector3<T> dv = acceleration(v_mid) * T(dt);
  state->p += (state->v + dv * T(0.5)) * T(dt);
  state->v += dv;
}

}  // namespace trueline
