// The coordinates in which the batch moves a vehicle's constants: log of the mass and logs of the
// second moments of mass, so that every point is a body that can exist; the others as they are.
#pragma once

#include <Eigen/Dense>

#include "problems/rotor_data/rotor_state.h"

namespace trueline {

using ConstantsJacobian =
    Eigen::Matrix<double, RotorAeroModel::kConstants, RotorAeroModel::kConstants>;

// The constants must be a body that can exist (IsPhysicalInertia); one that is as flat as can be,
// as fits end up at where no body has the inertia, keeps a trace of thickness.
RotorConstants ToChart(const RotorConstants& constants);
RotorConstants FromChart(const RotorConstants& chart);
// d constants / d chart.
ConstantsJacobian ChartJacobian(const RotorConstants& chart);

}  // namespace trueline
