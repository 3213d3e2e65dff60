// A vehicle of the rotor-driven model, from YAML (config/observe/, config/design/) or from a log;
// its constants' prior, and the coordinates in which a fit moves them.
#pragma once

#include <Eigen/Dense>
#include <deque>
#include <string>
#include <vector>

#include "cost_functions/models/rotor_driven_model.h"
#include "problems/common/yaml_archive.h"
#include "problems/log/flight_log.h"
#include "problems/rotor/rotor_state.h"

namespace trueline {

// A vehicle with its parameters as the model's kStates numbers, at rest and level.
struct RotorVehicle {
  RotorDrivenModel model;
  std::vector<double> parameters;
};

// Keys: mass, inertia [x, y, z], r_BM, r_BP, r_BI, rotors (as in a native log's vehicle). Throws
// InputError for an unphysical mass, inertia or rotor, naming the key.
RotorVehicle ReadRotorVehicle(const YamlMap& map, double gravity);

// A vehicle from the log's own section. A log does not state inertia and lever arms: inertia is
// guessed from mass and rotor positions (radius of gyration 0.4 of the mean rotor distance), lever
// arms are zero, and `warning` says so.
RotorVehicle VehicleFromLog(const FlightLog& log, std::string* warning);

// The prior on a vehicle's constants: nominal values with standard deviations.
struct RotorPrior {
  RotorConstants mean = RotorConstants::Zero();
  RotorConstants sigma = RotorConstants::Zero();  // zero: known, not estimated

  std::vector<int> Free() const;
  // True if the constant of this name is unknown; false for an empty name.
  bool Estimates(const std::string& name) const;
  // `constants` with the known ones at their values.
  RotorConstants WithKnown(const RotorConstants& constants) const;
};

// Means at the vehicle's nominal values, and sigmas for a new payload (kRotorConstants). The 18
// constants of Wuest et al. 2019 are free. All others are known: r_BI_z, k_f and k_m at the
// vehicle's values, those beyond Boehm et al. 2020 at zero.
RotorPrior PriorFromVehicle(const RotorVehicle& vehicle);

// `map` holds NAME: sigma, or NAME: {mean: ..., sigma: ...}; sigma 0 makes a constant known. Throws
// InputError for unknown names and lists the known ones.
void ReadRotorPrior(const YamlMap& map, RotorPrior* prior);
YAML::Node ToYaml(const RotorPrior& prior);

// The coordinates in which the batch moves a vehicle's constants: the log of the mass, the logs of
// the three second moments of mass instead of I_x, I_y, I_z, and all other constants unchanged.
// Every point of the chart is a physical body.
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
