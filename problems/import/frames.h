// Axes of foreign logs, as rotations to the native ones.
#pragma once

#include <Eigen/Core>

#include "problems/common/strict_yaml.h"

namespace trueline {

// From the source's axes to NED and to FRD; rotations but for a left-handed `matrix`.
struct SourceAxes {
  Eigen::Matrix3d earth = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d body = Eigen::Matrix3d::Identity();
};

// The keys `earth` and `body` of `map`; a missing one keeps the value of `fallback`.
//
//   earth: NED | ENU | NWU (z up, x is north) | {axes: [z, -x, -y], yaw_deg: 33}
//   body:  FRD | FLU | {axes: [x, -y, -z]}
//
// `axes` states which of the source's axes is the native first, second and third one. `yaw_deg`
// then rotates the earth about down: v_E = Rz(yaw) v. Axes must be right-handed. `matrix: [[...],
// [...], [...]]` is then applied: any orthogonal one, for vectors also left-handed.
SourceAxes ReadAxes(const YamlMap& map, const SourceAxes& fallback);

// The mapping that ReadAxes reads as `axes`.
YAML::Node AxesNode(const Eigen::Matrix3d& axes);

}  // namespace trueline
