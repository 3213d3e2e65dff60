// What terms of the open catalogue take from a log: turn rates, battery voltage, and quantities
// that lag.
#pragma once

#include <vector>

#include "cost_functions/models/force_effects.h"
#include "problems/log/flight_log.h"

namespace trueline {

// The quantity along the log, without the offset that a factor may have. `lag` in s; only turn
// rates and thrust may lag, for a log shows these without a fit. Throws InputError if the log lacks
// the stream.
TermSeries SeriesOf(const FlightLog& log, TermQuantity quantity, double lag);

// Gives factors that need it their series.
void BindTerms(const FlightLog& log, std::vector<TermFactor>* factors);
void BindTerms(const FlightLog& log, std::vector<SizedTerm>* terms);
// And turn rates, if there are terms.
void BindTerms(const FlightLog& log, ForceEffects* effects);

}  // namespace trueline
