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
// The point that lies a step away, along a path on which angular acceleration changes evenly: it is
// linear in the inverses of I_x, I_y, I_z and in k_m / I_z. In the chart's own coordinates where
// that path leaves the physical bodies.
RotorConstants MovedInChart(const RotorConstants& chart, const RotorConstants& step);
// d constants / d chart.
ConstantsJacobian ChartJacobian(const RotorConstants& chart);

}  // namespace trueline
