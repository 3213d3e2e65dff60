// The gain of found causes on held-out flight.
#pragma once

#include "problems/diagnosis/diagnosed_flight.h"

namespace trueline {

// The half of a flight that a cluster belongs to.
int HalfOf(int cluster);

// The mean difference over arcs (or replays) that both models predict. Neighbours share data, so
// the bootstrap resamples runs of them. The interval is stretched by what that lacks for few
// values: it holds the truth 94 to 98 % of the time for 6 to 60 independent ones.
Gain GainBetween(const std::map<int, double>& before, const std::map<int, double>& after);

// The gains of a flight's last Fit, whose causes and terms are `found`, against the same flight
// with the causes `without`.
Gains MeasureGain(const DiagnosedFlight& flight, const std::vector<Found>& found,
                  std::vector<Found> without);

// Those of all causes together. Stores the gains of each cause against the model with the other
// causes. All models have the noise of the flight's Reference. Witnesses must have been asked.
// `causes` are those of `found`, after false data if there are any; `flight` is fitted with
// `found`.
Gains MeasureGains(const DiagnosedFlight& flight, const std::vector<Found>& found,
                   std::vector<Cause>* causes);

}  // namespace trueline
