// What a diagnosis comes to.
#pragma once

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// Unmodelled motion or noise far beyond what flights have: no effect, but no clean flight either.
std::vector<std::string> ExtraordinaryNoise(const NoiseStrengths& noise);

// clean | explained | ambiguous | unexplained. A cause that another flight does not confirm, or
// that makes held-out arcs worse, is no explanation; nor are causes that leave something real.
std::string VerdictOf(const std::vector<Cause>& causes, const std::vector<Cause>& set_aside,
                      const std::vector<std::string>& unexplained_by);

}  // namespace trueline
