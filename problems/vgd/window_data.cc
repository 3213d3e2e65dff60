#include "problems/vgd/window_data.h"

#include <algorithm>

namespace trueline {

WindowData CutWindow(const FlightData& flight, const VgdOptions& options, int first, int tau,
                     bool with_arc) {
  const Pass& from = flight.passes[first];
  const Pass& to = flight.passes[tau - 1];
  WindowData data;
  data.begin = from.begin;
  data.end = with_arc && flight.HasArc(tau) ? flight.passes[tau].begin : to.end;
  data.fixes = std::span(flight.log.fixes).subspan(from.first, to.last - from.first + 1);
  data.passes = std::span(flight.passes).subspan(first, tau - first);
  data.force_sigma = flight.forces.sigma;
  if (flight.continuous) data.noise = flight.continuous->noise;
  if (options.drag_measurement.enabled) {
    const auto& samples = flight.forces.samples;
    const auto before = [](const ForceSample& s, TimeNs t) { return s.t < t; };
    const auto begin = std::lower_bound(samples.begin(), samples.end(), data.begin, before);
    const auto end = std::lower_bound(begin, samples.end(), data.end, before);
    data.forces = std::span(samples).subspan(begin - samples.begin(), end - begin);
  }
  return data;
}

}  // namespace trueline
