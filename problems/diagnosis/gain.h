// What the found causes are worth on flight that took no part in fitting them.
#pragma once

#include "problems/diagnosis/search.h"

namespace trueline {

// Final-point error of VGD's blind arcs without and with the causes. The flight is cut into blocks
// of passes; the arcs of every second block are predicted with the causes' parameters fitted on the
// other blocks alone, and the other way round.
// `after`: the log without what belongs to no gate.
Gain MeasureGain(const FlightLog& log, const FlightLog& after, const DiagnosisOptions& options,
                 const CauseSearch& search, const std::vector<Found>& found);

}  // namespace trueline
