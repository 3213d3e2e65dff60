// The unmodelled forces of a fitted flight between consecutive poses.
#pragma once

#include "problems/rotor_diagnosis/rotor_search.h"

namespace trueline {

// Mean specific force and angular acceleration (body axes) in sigmas, by segment.
std::vector<Eigen::Matrix<double, 6, 1>> SegmentDisturbances(const RotorSearch& search);

// p-value of a test for positive correlation between means over consecutive half seconds.
double WhitenessOf(const std::vector<double>& times,
                   const std::vector<Eigen::Matrix<double, 6, 1>>& disturbances);

}  // namespace trueline
