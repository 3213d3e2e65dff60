// What the found causes are worth on flight that took no part in fitting them.
#pragma once

#include <array>
#include <map>

#include "problems/diagnosis/search.h"

namespace trueline {

// A model as the two halves of a flight give it, each for the arcs of the other half.
struct HalfFits {
  FlightLog log;  // without what belongs to no gate
  std::vector<VelocitySample> path;
  std::array<PartFit, 2> by_half;
};

// The model of the search's last Fit, causes and parameters fitted on each half.
HalfFits FitHalves(const FlightLog& log, const CauseSearch& search,
                   const std::vector<Found>& found);

// Errors (m) by where they arise, each with what the other half of the flight says of parameters
// and causes.
struct HeldOutErrors {
  // Final points of VGD's blind arcs, by the cluster of the pass they follow. The window adds its
  // own state and no more, so that errors differ by the model and not by its noise.
  std::map<int, double> arcs;
  // Horizontal, of open-loop replays over a second against mocap, by segment; none without mocap.
  std::map<int, double> replays;
};
HeldOutErrors ErrorsOf(const HalfFits& fits, const CauseSearch& search, const VgdOptions& options);

// The difference over what both predict. Neighbours share fixes, so that the bootstrap draws runs.
Gain GainBetween(const std::map<int, double>& before, const std::map<int, double>& after);

// Whether a cause makes held-out flight worse by both measures taken together.
bool Harmful(const Cause& cause);

// What is measured on: the flight as recorded, and without the fixes that belong to no gate.
struct GainLogs {
  FlightLog recorded, kept;
};

// Gain of each cause against the model of the others, and of all together, into `diagnosis`; its
// causes must be those of `found`, after a false gate where there is one. `search` was fitted with
// `found`; `bare`: errors of the model without causes; `spare` is refitted on the way.
void MeasureGains(const GainLogs& logs, const DiagnosisOptions& options,
                  const std::vector<Found>& found, const CauseSearch& search,
                  const HeldOutErrors& bare, CauseSearch* spare, Diagnosis* diagnosis);

}  // namespace trueline
