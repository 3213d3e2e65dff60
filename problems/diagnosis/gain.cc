#include "problems/diagnosis/gain.h"

#include <algorithm>
#include <map>

#include "problems/common/random.h"
#include "problems/result/statistics.h"
#include "problems/vgd/vgd.h"

namespace trueline {
namespace {

constexpr int kBlock =
    3;  // clusters in a block: arcs of one block share nothing with the other fold

// Final-point errors by the number of the pass that the arc follows.
std::map<int, double> ArcErrors(const FlightLog& log, const VgdOptions& options) {
  const FlightData flight(log, options.drive, options.passes, options.drag_measurement);
  std::map<int, double> errors;
  for (const WindowEstimate& window : RunVgd(flight, options).windows) {
    if (window.arc && window.arc->truth) errors[window.tau] = window.arc->FinalPointError();
  }
  return errors;
}

void Bootstrap(const std::vector<double>& differences, Gain* gain) {
  constexpr int kDraws = 2000;
  Random random(1, "gain");
  std::vector<double> means;
  const int last = static_cast<int>(differences.size()) - 1;
  for (int draw = 0; draw < kDraws; ++draw) {
    double sum = 0.0;
    for (int i = 0; i <= last; ++i) sum += differences[random.UniformInt(0, last)];
    means.push_back(sum / (last + 1));
  }
  gain->low = Quantile(means, 0.025);
  gain->high = Quantile(means, 0.975);
}

}  // namespace

Gain MeasureGain(const FlightLog& log, const FlightLog& after, const DiagnosisOptions& options,
                 const CauseSearch& search, const std::vector<Found>& found) {
  Gain gain;
  VgdOptions vgd = options.vgd;
  vgd.adapt_drift = false;  // the same drift before and after, so that only the causes differ
  const std::map<int, double> before = ArcErrors(log, vgd);
  std::vector<double> differences, errors_before, errors_after;
  for (const int fold : {0, 1}) {
    // Arc tau follows pass tau (from 1), which is in cluster tau - 1 where passes are clusters.
    const auto held_out = [&](int cluster) { return (cluster / kBlock) % 2 == fold; };
    std::vector<bool> used;
    for (int c = 0; c < search.plan().clusters; ++c) used.push_back(!held_out(c));
    const std::vector<Eigen::VectorXd> values = search.ValuesFrom(found, used);
    std::vector<Effect> effects;
    for (std::size_t i = 0; i < found.size(); ++i) {
      effects.push_back(found[i].candidate.At(values[i]));
    }
    VgdOptions extended = vgd;
    extended.drive.force_effects = ForceEffectsOf(effects);
    const FlightLog corrected = CorrectLog(after, effects, search.path());
    for (const auto& [tau, error] : ArcErrors(corrected, extended)) {
      if (!held_out(tau - 1) || before.count(tau) == 0) continue;
      errors_before.push_back(before.at(tau));
      errors_after.push_back(error);
      differences.push_back(before.at(tau) - error);
    }
  }
  gain.arcs = static_cast<int>(differences.size());
  if (gain.arcs == 0) return gain;
  gain.before = Mean(errors_before);
  gain.after = Mean(errors_after);
  Bootstrap(differences, &gain);
  return gain;
}

}  // namespace trueline
