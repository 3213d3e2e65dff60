// Aerodynamic effects beyond the linear drag of Li et al. 2019, eq. 9: specific force in B that a
// better model adds to eq. 10. With v_B the air-relative velocity and T the specific thrust,
//   quadratic drag  f_xy += -c |v_B| v_xy
//   rotor drag      f_xy += -k T v_xy         (induced drag of the rotors grows with thrust)
//   wind            v_B = R_B_E (v_E - w_E)
//   drag step       K_x, K_y are multiplied by a factor from t_step on
#pragma once

#include "cost_functions/models/imu_driven_model.h"

namespace trueline {

struct ForceEffects {
  double quadratic_drag = 0.0;                       // c, 1/m
  double rotor_drag = 0.0;                           // k, s/m
  Eigen::Vector3d wind_E = Eigen::Vector3d::Zero();  // w, m/s
  double step_time = 0.0;                            // t_step, s from the start of the log
  double step_factor = 1.0;                          // factor, 1

  bool Any() const {
    return quadratic_drag != 0.0 || rotor_drag != 0.0 || !wind_E.isZero(0.0) || step_factor != 1.0;
  }

  // The specific force (B, m/s^2) that the effects add to eq. 10. K: (K_x, K_y) in 1/s. ground_B
  // and wind_B: velocity of body and air over ground, in B. thrust: T. t: s from the log's start.
  template <typename T>
  Vector3<T> AddedForce(const T& K_x, const T& K_y, const Vector3<T>& ground_B,
                        const Vector3<T>& wind_B, double thrust, double t) const {
    using std::sqrt;
    const Vector3<T> v = ground_B - wind_B;
    const T speed = sqrt(v.squaredNorm() + T(1e-12));  // the floor keeps derivatives finite at rest
    const T drag = -(speed * T(quadratic_drag) + T(rotor_drag * thrust));
    const T step(t >= step_time ? step_factor : 1.0);
    return Vector3<T>(K_x * (step * v[0] - ground_B[0]) + drag * v[0],
                      K_y * (step * v[1] - ground_B[1]) + drag * v[1], T(0));
  }
};

}  // namespace trueline
