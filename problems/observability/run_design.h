// Runs a design task and compares the result with random flights and figures.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "problems/observability/design_config.h"

namespace trueline {

// Scores, larger is better. Gramian: sigma_min of the scaled, marginalised Gramian. Bound: the
// factor by which the flight narrows the prior of `show` (1 / rms of sigma / prior sigma).
struct DesignOutcome {
  DesignResult result;                      // by the bound: iterations are flights tried
  std::optional<double> exact_score;        // by the exact Gramian instead of E2LOG
  std::vector<double> random_scores;        // sorted
  std::vector<double> lissajous_scores;     // sorted
  std::vector<double> sigma, random_sigma;  // Cramer-Rao (whole flight) of what is shown: designed,
                                            // and of a random flight; infinite where it can't be
                                            // flown
};

// Throws InputError if no flight keeps the limits.
DesignOutcome RunDesignTask(const DesignTask& task,
                            const std::function<void(const std::string&)>& progress);

// trajectory.yaml, trajectory.csv and score.yaml in `directory`.
void WriteDesign(const DesignTask& task, const DesignOutcome& outcome,
                 const std::filesystem::path& directory);

std::string DesignTable(const DesignTask& task, const DesignOutcome& outcome);

}  // namespace trueline
