// Which effect, or which two, explain best what a fit leaves.
#pragma once

#include "problems/rotor_diagnosis/rotor_evidence.h"

namespace trueline {

struct RotorExplanation {
  std::vector<RotorTested> effects;                // none, one or two
  std::vector<std::vector<std::string>> confused;  // by effect: ids that fit as well
  double merit = 0.0;  // of the effects, or of one of them and a second one where that is more
};

// Of effects that fit alike the one with the fewest parameters is taken, and one before two, as it
// is likelier: two only where they explain clearly more than the best single one, alone or with any
// other. Where one effect with many parameters does the work of two with few (drag along three axes
// that of blades and inflow, while rotor speeds hardly change), both fit alike, and the two are
// among those that the one is confused with.
RotorExplanation Explain(const RotorEvidence& evidence, double alpha);

}  // namespace trueline
