// The gain of found causes on held-out flight.
#pragma once

#include <array>
#include <map>

#include "problems/diagnosis/search.h"

namespace trueline {

// A model fitted on each half of a flight; each fit predicts the arcs of the other half.
struct HalfFits {
  FlightLog log;  // without fixes of a false gate
  std::vector<VelocitySample> path;
  std::array<PartFit, 2> by_half;
};

// The model of the search's last Fit, causes and parameters fitted on each half.
HalfFits FitHalves(const FlightLog& log, const CauseSearch& search,
                   const std::vector<Found>& found);

// Errors (m) by place, each predicted with parameters and causes of the other half of the flight.
struct HeldOutErrors {
  // Final points of VGD's arcs, by the cluster of the pass before. The window estimates its own
  // state only, so that errors compare models and not the noise of refitted parameters.
  std::map<int, double> arcs;
  // Horizontal errors of open-loop replays over a second against mocap, by segment; empty without
  // mocap.
  std::map<int, double> replays;
};
HeldOutErrors ErrorsOf(const HalfFits& fits, const CauseSearch& search, const VgdOptions& options);

// The mean difference over arcs (or replays) that both models predict. Neighbours share fixes, so
// the bootstrap resamples runs of them.
Gain GainBetween(const std::map<int, double>& before, const std::map<int, double>& after);

// True if a cause makes held-out flight worse by both measures combined.
bool Harmful(const Cause& cause);

// The logs for measuring: the flight as recorded, and without the fixes of a false gate.
struct GainLogs {
  FlightLog recorded, kept;
};

// Stores in `diagnosis` the gain of each cause against the model with the other causes, and that of
// all together. Its causes must be those of `found`, after a false gate if there is one. `search`
// is fitted with `found`. `bare`: errors of the model without causes. `spare` is refitted as
// scratch.
void MeasureGains(const GainLogs& logs, const DiagnosisOptions& options,
                  const std::vector<Found>& found, const CauseSearch& search,
                  const HeldOutErrors& bare, CauseSearch* spare, Diagnosis* diagnosis);

}  // namespace trueline
