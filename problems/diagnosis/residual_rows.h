// Whitened residuals of a diagnosis' fit, for its result files and the test of their whiteness.
#pragma once

#include "problems/diagnosis/base_flight.h"
#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// Root mean square of the fixes' whitened residuals, sigmas; fixes are the first rows.
double RmsOfFixes(const BaseFlight& flight, const Eigen::VectorXd& whitened);

// One report for each fix and force sample; `before` and `after` are measurement rows in sigmas.
std::vector<RowReport> RowReports(const BaseFlight& flight, const Eigen::VectorXd& before,
                                  const Eigen::VectorXd& after);

// p-value of the correlation between neighbouring fixes under whiteness, for the residuals before
// or after the causes. The statistic is the sum of products over its own empirical scatter, so
// heavy tails do not bias it; it is compared with the normal distribution.
double WhitenessOf(const std::vector<RowReport>& rows, Eigen::Vector3d RowReport::*when);

}  // namespace trueline
