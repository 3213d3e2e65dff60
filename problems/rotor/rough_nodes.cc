#include "problems/rotor/rough_nodes.h"

#include <algorithm>

namespace trueline {
namespace {

constexpr double kHalfSlope = 0.05;  // s
constexpr double kHalfMean = 0.01;   // s

Eigen::Vector3d MeanGyro(const RotorData& data, double t) {
  auto first = std::ranges::lower_bound(data.imu, t - kHalfMean, {}, &RotorImu::t);
  auto last = std::ranges::lower_bound(data.imu, t + kHalfMean, {}, &RotorImu::t);
  if (first == last) {  // a gap: use the next sample, or the last one
    if (first == data.imu.end()) --first;
    last = first + 1;
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (auto sample = first; sample != last; ++sample) sum += sample->gyro;
  return sum / static_cast<double>(last - first);
}

// Index of the last pose not after `t`.
int PoseBefore(const RotorData& data, double t) {
  const auto after = std::ranges::upper_bound(data.poses, t, {}, &RotorPose::t);
  return std::max(0, static_cast<int>(after - data.poses.begin()) - 1);
}

}  // namespace

std::vector<RotorNode> RoughNodes(const RotorData& data, const RotorConstants& constants) {
  const int count = static_cast<int>(data.poses.size());
  const auto constant = [&](int index) -> Eigen::Vector3d {
    return constants.segment<3>(index - RotorAeroModel::kMoving);
  };
  const Eigen::Vector3d arm =
      constant(RotorDrivenModel::kPoseArm) - constant(RotorDrivenModel::kCentre);
  std::vector<RotorNode> nodes;
  nodes.reserve(count);
  for (const RotorPose& pose : data.poses) {
    RotorNode node;
    node.motion.head<4>() << pose.q_E_P.w(), pose.q_E_P.vec();
    node.motion.segment<3>(RotorDrivenModel::kPosition) = pose.p_E - pose.q_E_P * arm;
    node.motion.segment<3>(RotorDrivenModel::kRate) =
        MeanGyro(data, pose.t) - constant(RotorDrivenModel::kGyroBias);
    nodes.push_back(node);
  }
  for (int i = 0; i < count; ++i) {
    const double t = data.poses[i].t;
    const int a = std::min(i, std::max(PoseBefore(data, t - kHalfSlope), 0));
    const int b =
        std::max(std::min(PoseBefore(data, t + kHalfSlope), count - 1), std::min(a + 1, count - 1));
    const int from = a == b ? b - 1 : a;
    nodes[i].motion.segment<3>(RotorDrivenModel::kVelocity) =
        (nodes[b].motion.segment<3>(RotorDrivenModel::kPosition) -
         nodes[from].motion.segment<3>(RotorDrivenModel::kPosition)) /
        (data.poses[b].t - data.poses[from].t);
  }
  return nodes;
}

}  // namespace trueline
