// The coordinates in which the batch moves a vehicle's constants: the log of the mass, the logs of
// the three second moments of mass instead of I_x, I_y, I_z, and all other constants unchanged.
// Every point of the chart is a physical body.
#pragma once

#include <Eigen/Dense>

#include "problems/rotor/rotor_state.h"

namespace trueline {

using ConstantsJacobian =
    Eigen::Matrix<double, RotorAeroModel::kConstants, RotorAeroModel::kConstants>;

// The inertia must be physical (IsPhysicalInertia). A second moment of zero (a flat body, where
// fits with an unphysical optimum end) is raised to a small share of the trace, because its log is
// infinite.
RotorConstants ToChart(const RotorConstants& constants);
RotorConstants FromChart(const RotorConstants& chart);
// d constants / d chart.
ConstantsJacobian ChartJacobian(const RotorConstants& chart);

}  // namespace trueline
