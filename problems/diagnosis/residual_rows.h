// Whitened residuals of a diagnosis' fit, for its result files and the test of their whiteness.
#pragma once

#include "problems/diagnosis/base_flight.h"
#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// Root mean square of the fixes' whitened residuals, sigmas; they stand before all others.
double RmsOfFixes(const BaseFlight& flight, const Eigen::VectorXd& whitened);

// By fix and sample of force; `before` and `after` hold measurement rows alike (sigmas).
std::vector<RowReport> RowReports(const BaseFlight& flight, const Eigen::VectorXd& before,
                                  const Eigen::VectorXd& after);

// Probability of a correlation between neighbouring fixes as large as this, were they white; of the
// residuals before or after the causes. The sum of products over its own scatter, which heavy tails
// do not disturb, against the normal distribution.
double WhitenessOf(const std::vector<RowReport>& rows, Eigen::Vector3d RowReport::*when);

}  // namespace trueline
