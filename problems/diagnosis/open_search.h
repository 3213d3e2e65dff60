// Search of the open catalogue (open_term.h): which terms describe what the causes leave.
#pragma once

#include <vector>

#include "problems/diagnosis/diagnosed_flight.h"

namespace trueline {

// Forward selection of at most a few terms on the flight's last Fit, whose causes are `found`. A
// term is described if it is significant at `alpha` over all terms, by the noise and by the scatter
// between clusters, and if each half of the flight predicts the other half better with the size
// that it shows. Of terms that fit alike, the shortest formula is taken. Each is fitted like a
// cause, and added to `found`, before the next one is searched; a term that is then no longer
// significant is dropped.
OpenCatalogue DescribeMisfit(DiagnosedFlight* flight, std::vector<Found>* found, double alpha);

}  // namespace trueline
