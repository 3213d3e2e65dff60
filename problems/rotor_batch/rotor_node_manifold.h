// The moving state as a manifold for Ceres: 13 numbers, 12 of error (rotor_state.h), attitude
// perturbed on the right.
#pragma once

#include <ceres/manifold.h>

#include "problems/rotor_data/rotor_state.h"

namespace trueline {

// d(error) / d(numbers), 12 x 13: converts Jacobians by the error to Ceres' ambient Jacobians.
inline Eigen::Matrix<double, 12, 13> NodeMinusJacobian(const double* x) {
  Eigen::Matrix<double, 12, 13> jacobian = Eigen::Matrix<double, 12, 13>::Zero();
  const Vec4<double> q(x[0], x[1], x[2], x[3]);
  for (int axis = 0; axis < 3; ++axis) {
    // Columns of d q / d theta are orthogonal and of length 1/2, so 4 times the transpose inverts.
    const Vec4<double> column = TimesPure(q, Vec3<double>(0.5 * Vec3<double>::Unit(axis)));
    jacobian.block<1, 4>(axis, 0) = 4.0 * column.transpose();
  }
  jacobian.bottomRightCorner<9, 9>().setIdentity();
  return jacobian;
}

class RotorNodeManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 13; }
  int TangentSize() const override { return 12; }

  bool Plus(const double* x, const double* delta, double* moved) const override {
    RotorError error = RotorError::Zero();
    error.head<12>() = Eigen::Map<const Eigen::Matrix<double, 12, 1>>(delta);
    const RotorState sum =
        trueline::Plus(Joined(Eigen::Map<const RotorNode>(x), RotorConstants::Zero()), error);
    Eigen::Map<RotorNode>{moved} = sum.head<13>();
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 13, 12, Eigen::RowMajor>> J(jacobian);
    J.setZero();
    J.topLeftCorner<4, 3>() = 0.25 * NodeMinusJacobian(x).topLeftCorner<3, 4>().transpose();
    J.bottomRightCorner<9, 9>().setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* delta) const override {
    const RotorConstants none = RotorConstants::Zero();
    Eigen::Map<Eigen::Matrix<double, 12, 1>>{delta} =
        trueline::Minus(Joined(Eigen::Map<const RotorNode>(x), none),
                        Joined(Eigen::Map<const RotorNode>(y), none))
            .head<12>();
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 12, 13, Eigen::RowMajor>>{jacobian} = NodeMinusJacobian(x);
    return true;
  }
};

}  // namespace trueline
