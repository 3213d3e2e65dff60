// How the rows of a flight change with the parameters of effects: difference quotients at the base
// solution, the flight's own unknowns held.
#pragma once

#include "problems/diagnosis/base_fit.h"
#include "problems/diagnosis/catalogue.h"

namespace trueline {

// What sensitivities are taken around.
struct SensitivityBase {
  const FlightLog& log;  // as recorded
  const FlightPlan& plan;
  const VgdOptions& options;
  const std::vector<Effect>& effects;       // already in the model
  const std::vector<VelocitySample>& path;  // of the base solution
};

// Columns (rows of FlightRows x parameters) of one candidate on top of the base's effects, at
// `parameters`. `flight` is the base flight at `x` with all of these effects in it already.
Eigen::MatrixXd Sensitivity(const SensitivityBase& base, const Candidate& candidate,
                            const Eigen::VectorXd& parameters, const FlightUnknowns& x,
                            BaseFlight* flight);

}  // namespace trueline
