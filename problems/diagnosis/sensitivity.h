// Derivatives of a flight's rows by effect parameters: difference quotients at the base solution,
// with the flight's own unknowns held.
#pragma once

#include "problems/diagnosis/base_fit.h"
#include "problems/diagnosis/catalogue.h"

namespace trueline {

// The linearisation point of sensitivities.
struct SensitivityBase {
  const FlightLog& log;  // as recorded
  const FlightPlan& plan;
  const VgdOptions& options;
  const std::vector<Effect>& effects;       // already in the model
  const std::vector<VelocitySample>& path;  // of the base solution
};

// Columns (rows of FlightRows x parameters) of one candidate, in addition to the base's effects, at
// `parameters`. `flight` is the base flight at `x` with all of these effects applied.
Eigen::MatrixXd Sensitivity(const SensitivityBase& base, const Candidate& candidate,
                            const Eigen::VectorXd& parameters, const FlightUnknowns& x,
                            BaseFlight* flight);

}  // namespace trueline
