#include "problems/vgd/window_data.h"

#include "problems/log/samples_between.h"

namespace trueline {

WindowData CutWindow(const FlightData& flight, const VgdOptions& options, int first, int tau,
                     bool with_arc) {
  const bool on = with_arc && flight.HasArc(tau);
  return CutWindowUntil(flight, options, first, tau,
                        on ? flight.passes[tau].begin : flight.passes[tau - 1].end);
}

WindowData CutWindowUntil(const FlightData& flight, const VgdOptions& options, int first, int tau,
                          TimeNs end) {
  const Pass& from = flight.passes[first];
  const Pass& to = flight.passes[tau - 1];
  WindowData data;
  data.begin = from.begin;
  data.end = end;
  data.fixes = std::span(flight.log.fixes).subspan(from.first, to.last - from.first + 1);
  data.passes = std::span(flight.passes).subspan(first, tau - first);
  data.force_sigma = flight.forces.sigma;
  if (flight.continuous) data.noise = flight.continuous->noise;
  if (options.drag_measurement.enabled) {
    data.forces = SamplesBetween(flight.forces.samples, data.begin, data.end);
  }
  return data;
}

}  // namespace trueline
