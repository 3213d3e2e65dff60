// The verdict of a diagnosis.
#pragma once

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// clean | explained | ambiguous | unexplained. A flight is not explained if a cause is not
// confirmed by another flight, if it makes held-out arcs worse, or if a significant misfit remains.
std::string VerdictOf(const std::vector<Cause>& causes, const std::vector<Cause>& set_aside,
                      const std::vector<std::string>& unexplained_by);

}  // namespace trueline
