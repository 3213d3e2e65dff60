// The residual of a fix whose detector has a latency, a misalignment, or a map with displaced
// gates.
//
//   prediction: p(t_i) - tau v(t_i) - (R_E_B c) x (g - p) - d
//               tau (s) latency of fixes; c (rad) misalignment of the camera in body axes; d (m)
//               displacement of the gate from its place g on the map. First order in all three;
//               g - p is taken from the fix itself.
//   error:      prediction - fix, in m
//   weighting:  divided by the detector's sigma, the same for each axis
//   unknowns:   theta, drift, state (segment_node.h); mount (tau, c) and gate (d), both in units of
//               their prior sigmas (zero: not estimated)
#pragma once

#include "cost_functions/fix_residual.h"

namespace trueline {

inline constexpr int kMountSize = 4;  // tau, c
inline constexpr int kGateSize = 3;   // d

struct MountedFix {
  Eigen::Vector3d p_E;                         // m, the fix
  double sigma;                                // m
  Eigen::Vector3d to_gate_E;                   // m, g - fix
  Eigen::Matrix3d R_E_B;                       // attitude as logged
  Eigen::Matrix<double, kMountSize, 1> mount;  // prior sigmas: s, rad
  double gate;                                 // m, prior sigma
};

class MountedFixResidual : public ceres::SizedCostFunction<3, kThetaSize, kDriftSize, kStateSize,
                                                           kMountSize, kGateSize> {
 public:
  // `node` must outlive the problem.
  MountedFixResidual(const StateNode* node, const MountedFix& fix) : node_(node), fix_(fix) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Matrix<double, kMountSize, 1>> mount(parameters[3]);
    const Eigen::Map<const Eigen::Vector3d> gate(parameters[4]);
    const double tau = fix_.mount[0] * mount[0];
    const Eigen::Vector3d v = node_->value.tail<3>();
    // d(prediction)/d(mount)
    Eigen::Matrix<double, 3, kMountSize> d_mount;
    d_mount.col(0) = -v * fix_.mount[0];
    for (int i = 0; i < 3; ++i) {
      d_mount.col(1 + i) = -fix_.R_E_B.col(i).cross(fix_.to_gate_E) * fix_.mount[1 + i];
    }
    const double weight = 1.0 / fix_.sigma;
    Eigen::Map<Eigen::Vector3d> r(residuals);
    r = weight * (node_->value.head<3>() + d_mount * mount - fix_.gate * gate - fix_.p_E);
    if (jacobians != nullptr) {
      const auto later = [&](const auto& d) {
        return (d.template topRows<3>() - tau * d.template bottomRows<3>()).eval();
      };
      Write<kThetaSize>(weight * later(node_->d_theta), jacobians[0]);
      Write<kDriftSize>(weight * later(node_->d_drift().eval()), jacobians[1]);
      Write<kStateSize>(weight * later(node_->d_state), jacobians[2]);
      Write<kMountSize>(weight * d_mount, jacobians[3]);
      Write<kGateSize>(-weight * fix_.gate * Eigen::Matrix3d::Identity(), jacobians[4]);
    }
    return r.allFinite();
  }

 private:
  template <int kCols>
  static void Write(const Eigen::Matrix<double, 3, kCols>& d, double* jacobian) {
    if (jacobian == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, 3, kCols, Eigen::RowMajor>> J(jacobian);
    J = d;
  }

  const StateNode* node_;
  MountedFix fix_;
};

}  // namespace trueline
