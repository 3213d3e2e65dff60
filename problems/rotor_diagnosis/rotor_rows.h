// What a fitted flight leaves to explain, between each two poses.
#pragma once

#include "problems/rotor_diagnosis/rotor_search.h"

namespace trueline {

// Mean specific force and angular acceleration (body axes) in sigmas, by segment.
std::vector<Eigen::Matrix<double, 6, 1>> SegmentDisturbances(const RotorSearch& search);

// Probability of means over half a second as alike from one to the next as these, were they white.
double WhitenessOf(const std::vector<double>& times,
                   const std::vector<Eigen::Matrix<double, 6, 1>>& disturbances);

}  // namespace trueline
