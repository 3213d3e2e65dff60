// Beyond the catalogue: general terms of force and of fix errors, for the IMU-driven model. They
// describe a residual that no effect explains and are never named as a cause.
#pragma once

#include <string>
#include <vector>

#include "problems/diagnosis/base_fit.h"
#include "problems/diagnosis/open_term.h"

namespace trueline {

struct ImuTerm {
  std::string name;          // the variable that the residual is correlated with
  Eigen::MatrixXd columns;   // by row of FlightRows
  Eigen::VectorXd ordinary;  // sizes that are not reported
};

// Force terms: products of velocity, turn rate and thrust in body axes, place on the course,
// heading and time, as accelerations. Fix terms: distance, place in the picture and time, as errors
// of fixes. At the solution `x`.
std::vector<ImuTerm> ImuTerms(BaseFlight* flight, const FlightUnknowns& x);

}  // namespace trueline
