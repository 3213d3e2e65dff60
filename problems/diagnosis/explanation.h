// Which effect, or which pair of effects, best explains the residuals of a fit.
#pragma once

#include "problems/diagnosis/evidence.h"

namespace trueline {

struct Explanation {
  std::vector<Tested> effects;  // none, one or two
  double merit = 0.0;           // of them; of one of them with a second one if that is more
};

// Of effects that fit equally well, chooses the one with the fewest parameters. One effect is more
// likely than two, so a pair is chosen only if it explains clearly more than the best single
// effect, alone or in any pair. One effect with many parameters can fit as well as two with few:
// drag along three axes fits like blade drag and inflow while rotor speeds hardly change. The two
// are then listed among the effects that the one is confused with.
Explanation Explain(const FlightEvidence& evidence, double alpha);

}  // namespace trueline
