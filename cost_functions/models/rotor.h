#pragma once

#include <Eigen/Core>

namespace trueline {

// One rotor: thrust k_f u along `axis`, reaction moment spin k_m u along `axis`, u the squared
// speed. A rotor that turns clockwise seen from above (spin +1) turns the body anticlockwise: a
// moment along its upward axis.
struct Rotor {
  Eigen::Vector3d position;              // m, in B
  Eigen::Vector3d axis{0.0, 0.0, -1.0};  // unit vector of thrust, in B
  int spin = 1;                          // +1 clockwise seen from above
  double k_f = 0.0;                      // N s^2
  double k_m = 0.0;                      // N m s^2
};

}  // namespace trueline
