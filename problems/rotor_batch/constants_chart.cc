#include "problems/rotor_batch/constants_chart.h"

#include <cmath>

namespace trueline {
namespace {

constexpr int kMass = RotorDrivenModel::kMass - RotorDrivenModel::kMoving;
constexpr int kInertia = RotorDrivenModel::kInertia - RotorDrivenModel::kMoving;

}  // namespace

RotorConstants ToChart(const RotorConstants& constants) {
  RotorConstants chart = constants;
  chart[kMass] = std::log(constants[kMass]);
  chart.segment<3>(kInertia) =
      LogSecondMomentsFromInertia(Vec3<double>(constants.segment<3>(kInertia)));
  return chart;
}

RotorConstants FromChart(const RotorConstants& chart) {
  RotorConstants constants = chart;
  constants[kMass] = std::exp(chart[kMass]);
  constants.segment<3>(kInertia) =
      InertiaFromLogSecondMoments(Vec3<double>(chart.segment<3>(kInertia)));
  return constants;
}

ConstantsJacobian ChartJacobian(const RotorConstants& chart) {
  ConstantsJacobian jacobian = ConstantsJacobian::Identity();
  jacobian(kMass, kMass) = std::exp(chart[kMass]);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      jacobian(kInertia + i, kInertia + j) = i == j ? 0.0 : std::exp(chart[kInertia + j]);
    }
  }
  return jacobian;
}

}  // namespace trueline
