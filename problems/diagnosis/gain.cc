#include "problems/diagnosis/gain.h"

#include "problems/common/random.h"
#include "problems/diagnosis/thresholds.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

double MeanOfRuns(const std::vector<double>& values, Random* random) {
  const int count = static_cast<int>(values.size());
  double sum = 0.0;
  int drawn = 0;
  while (drawn < count) {
    const int first = random->UniformInt(0, count - 1);
    for (int k = 0; k < kBlockClusters && drawn < count; ++k, ++drawn) {
      sum += values[(first + k) % count];
    }
  }
  return sum / count;
}

// What a bootstrap over runs of neighbours, round a circle, lacks for few values: its variance is
// too small by the share that one run is of all, and it takes that variance for known. Overlapping
// runs tell it as 1.5 times as many apart would (Kuensch 1989).
double StretchOfFew(int values) {
  const double runs = static_cast<double>(values) / kBlockClusters;
  const double t2 = FCritical(kSingleAlpha, 1.0, 1.5 * runs - 1.0);
  const double z2 = ChiSquareCritical(kSingleAlpha, 1.0);
  return std::sqrt(t2 / z2 * runs / (runs - 1.0));
}

Gains GainsBetween(const HeldOutErrors& before, const HeldOutErrors& after) {
  Gains gains{GainBetween(before.arcs, after.arcs), GainBetween(before.replays, after.replays)};
  gains.arcs.metric = after.metric;
  return gains;
}

// Of what the cause's witness compares; none if that is no stream against mocap.
Gain AgreementGain(const HeldOutErrors& before, const HeldOutErrors& after,
                   const Witness& witness) {
  const auto was = before.streams.find(witness.stream), is = after.streams.find(witness.stream);
  if (was == before.streams.end() || is == after.streams.end()) return {};
  Gain gain = GainBetween(was->second.by_second, is->second.by_second);
  gain.metric = witness.stream;
  gain.unit = is->second.unit;
  return gain;
}

}  // namespace

int HalfOf(int cluster) { return (cluster / kBlockClusters) % 2; }

Gain GainBetween(const std::map<int, double>& before, const std::map<int, double>& after) {
  constexpr int kDraws = 2000;
  std::vector<double> differences, errors_before, errors_after;
  for (const auto& [cluster, error] : after) {
    const auto other = before.find(cluster);
    if (other == before.end()) continue;
    errors_before.push_back(other->second);
    errors_after.push_back(error);
    differences.push_back(other->second - error);
  }
  Gain gain;
  gain.arcs = static_cast<int>(differences.size());
  if (gain.arcs == 0) return gain;
  gain.before = Mean(errors_before);
  gain.after = Mean(errors_after);
  if (gain.arcs < 2 * kBlockClusters) return gain;
  Random random(1, "gain");
  std::vector<double> means(kDraws);
  for (double& mean : means) mean = MeanOfRuns(differences, &random);
  const double mean = gain.before - gain.after, stretch = StretchOfFew(gain.arcs);
  gain.low = mean + stretch * (Quantile(means, 0.5 * kSingleAlpha) - mean);
  gain.high = mean + stretch * (Quantile(means, 1.0 - 0.5 * kSingleAlpha) - mean);
  return gain;
}

Gains MeasureGain(const DiagnosedFlight& flight, const std::vector<Found>& found,
                  std::vector<Found> without) {
  const auto reference = flight.Reference();
  if (!without.empty()) reference->Fit(&without);
  return GainsBetween(reference->ErrorsHeldOut(without, false), flight.ErrorsHeldOut(found, false));
}

Gains MeasureGains(const DiagnosedFlight& flight, const std::vector<Found>& found,
                   std::vector<Cause>* causes) {
  const auto reference = flight.Reference();
  const HeldOutErrors bare = reference->ErrorsHeldOut({}, true);
  const HeldOutErrors all = flight.ErrorsHeldOut(found, false);
  const std::size_t false_data = causes->size() - found.size();  // they come first in `causes`
  for (std::size_t i = 0; i < causes->size(); ++i) {
    HeldOutErrors before = bare;
    if (causes->size() > 1 && i < false_data) {
      before = flight.ErrorsHeldOut(found, true);
    } else if (causes->size() > 1) {
      std::vector<Found> others = found;
      EraseAt(i - false_data, &others);
      reference->Fit(&others);
      before = reference->ErrorsHeldOut(others, false);
    }
    Cause& cause = (*causes)[i];
    cause.gains = GainsBetween(before, all);
    cause.agreement = AgreementGain(before, all, cause.witness);
  }
  return GainsBetween(bare, all);
}

}  // namespace trueline
