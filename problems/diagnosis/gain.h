// The gain of found causes on held-out flight.
#pragma once

#include "problems/diagnosis/diagnosed_flight.h"

namespace trueline {

// Clusters of a flight belong to one half or the other in blocks of three, which share fixes.
inline constexpr int kBlockClusters = 3;
int HalfOf(int cluster);

inline constexpr int kFewestForInterval = 2 * kBlockClusters;  // arcs

// The mean difference over arcs (or replays) that both models predict. Neighbours share data, so
// the bootstrap resamples runs of them. The interval is stretched by what that lacks for few
// values: it holds the truth 94 to 98 % of the time for 6 to 60 independent ones.
Gain GainBetween(const std::map<int, double>& before, const std::map<int, double>& after);

// The gain of a flight's last Fit, whose causes and terms are `found`, against the same flight with
// the causes `without`.
void MeasureGain(const DiagnosedFlight& flight, const std::vector<Found>& found,
                 std::vector<Found> without, Gain* arcs, Gain* replays);

// Measures the gains of causes in the model of a flight, all models under the noise of its
// Reference.
class HeldOutGains {
 public:
  explicit HeldOutGains(const DiagnosedFlight& flight);

  // Stores the gains of each cause against the model with the other causes, and those of all
  // together (arcs, replays). Witnesses must have been asked. `causes` are those of `found`, after
  // false data if there are any; `flight` is fitted with `found`.
  void Measure(const DiagnosedFlight& flight, const std::vector<Found>& found,
               std::vector<Cause>* causes, Gain* arcs, Gain* replays) const;

 private:
  HeldOutErrors Without(std::size_t which, std::vector<Found> found) const;

  std::unique_ptr<DiagnosedFlight> reference_;
  HeldOutErrors bare_;  // of the model without causes
};

}  // namespace trueline
