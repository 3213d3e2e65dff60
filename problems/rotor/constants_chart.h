// The coordinates in which the batch moves a vehicle's constants: the log of the mass, the logs of
// the three second moments of mass instead of I_x, I_y, I_z, and all other constants unchanged.
// Every point of the chart is a physical body.
#pragma once

#include <Eigen/Dense>
#include <deque>

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

// Anderson acceleration (Anderson 1965): finds x with g(x) = x where the plain iteration x <- g(x)
// oscillates or converges slowly.
class FixedPoint {
 public:
  // The next x to try. `scale`: the unit of each component of g(x) - x; zero for known components.
  RotorConstants Next(const RotorConstants& x, const RotorConstants& g,
                      const RotorConstants& scale) {
    constexpr std::size_t kMemory = 4;
    moves_.push_back(g - x);
    images_.push_back(g);
    if (moves_.size() > kMemory) moves_.pop_front(), images_.pop_front();
    const auto columns = static_cast<Eigen::Index>(moves_.size()) - 1;
    if (columns == 0) return g;
    const RotorConstants weight = (scale.array() > 0.0).select(scale.cwiseInverse(), 0.0);
    Eigen::MatrixXd d_move(g.size(), columns), d_image(g.size(), columns);
    for (Eigen::Index i = 0; i < columns; ++i) {
      d_move.col(i) = weight.cwiseProduct(moves_[i + 1] - moves_[i]);
      d_image.col(i) = images_[i + 1] - images_[i];
    }
    return g - d_image * d_move.colPivHouseholderQr().solve(weight.cwiseProduct(g - x));
  }

 private:
  std::deque<RotorConstants> moves_, images_;
};

}  // namespace trueline
