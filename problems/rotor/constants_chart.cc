#include "problems/rotor/constants_chart.h"

#include <cmath>

namespace trueline {
namespace {

constexpr double kThinnest = 1e-6;  // share of the trace that each second moment has at least

}  // namespace

RotorConstants ToChart(const RotorConstants& constants) {
  RotorConstants chart = constants;
  chart[kMassConstant] = std::log(constants[kMassConstant]);
  const Eigen::Vector3d inertia = constants.segment<3>(kInertiaConstants);
  const Eigen::Vector3d moments = (0.5 * inertia.sum() - inertia.array()).matrix();
  chart.segment<3>(kInertiaConstants) = moments.cwiseMax(kThinnest * inertia.sum()).array().log();
  return chart;
}

RotorConstants FromChart(const RotorConstants& chart) {
  RotorConstants constants = chart;
  constants[kMassConstant] = std::exp(chart[kMassConstant]);
  constants.segment<3>(kInertiaConstants) =
      InertiaFromLogSecondMoments(Vec3<double>(chart.segment<3>(kInertiaConstants)));
  return constants;
}

RotorConstants MovedInChart(const RotorConstants& chart, const RotorConstants& step) {
  const int yaw = FindRotorConstant("k_m");
  const RotorConstants from = FromChart(chart), by = ChartJacobian(chart) * step;
  const Eigen::Array3d inertia = from.segment<3>(kInertiaConstants).array();
  const Eigen::Array3d share = by.segment<3>(kInertiaConstants).array() / inertia;
  RotorConstants moved = chart + step;
  if (!(share < 1.0).all()) return moved;
  RotorConstants to = FromChart(moved);
  to.segment<3>(kInertiaConstants) = (inertia / (1.0 - share)).matrix();
  if (!IsPhysicalInertia(to.segment<3>(kInertiaConstants))) return moved;
  moved.segment<3>(kInertiaConstants) = ToChart(to).segment<3>(kInertiaConstants);
  moved[yaw] = (from[yaw] * (1.0 - share[2]) + by[yaw]) / (1.0 - share[2]);
  return moved;
}

ConstantsJacobian ChartJacobian(const RotorConstants& chart) {
  ConstantsJacobian jacobian = ConstantsJacobian::Identity();
  jacobian(kMassConstant, kMassConstant) = std::exp(chart[kMassConstant]);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      jacobian(kInertiaConstants + i, kInertiaConstants + j) =
          i == j ? 0.0 : std::exp(chart[kInertiaConstants + j]);
    }
  }
  return jacobian;
}

}  // namespace trueline
