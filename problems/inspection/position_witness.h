// Positions with an attitude beside them: what the accelerometer is judged by.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/inspection/examination.h"

namespace trueline {

struct PositionWitness {
  std::string stream;       // mocap, pose or fixes
  std::string of_attitude;  // the stream that turns the specific force to earth axes
  std::vector<AttitudeSample> attitude;
  std::vector<Bend> bends;
  double noise;  // m, usual error of a position
};

// Of the repaired log. Empty where the stream has too few positions or no attitude fits.
// `wider`: factor of the bends' width.
std::optional<PositionWitness> PositionWitnessOf(const Examination& e, const std::string& stream,
                                                 double wider = 1.0);

}  // namespace trueline
