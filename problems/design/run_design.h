// A design by the criterion that is asked for, with what it is compared to.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "problems/design/design_config.h"

namespace trueline {

// Scores: sigma_min of the scaled, marginalised Gramian; or, by the bound, how many times the
// flight narrows the prior of what it shows (1 / rms of sigma / prior sigma). Larger is better.
struct DesignOutcome {
  DesignResult result;                      // by the bound: iterations are flights tried
  std::optional<double> exact_score;        // by the exact Gramian instead of E2LOG
  std::vector<double> random_scores;        // sorted
  std::vector<double> lissajous_scores;     // sorted
  std::vector<double> sigma, random_sigma;  // Cramer-Rao (whole flight) of what is shown: designed,
                                            // and of a random flight; infinite where it can't be
                                            // flown
};

// Throws InputError where no flight keeps the limits.
DesignOutcome RunDesignTask(const DesignTask& task,
                            const std::function<void(const std::string&)>& progress);

}  // namespace trueline
