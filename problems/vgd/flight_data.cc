#include "problems/vgd/flight_data.h"

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/log/samples.h"

namespace trueline {

FlightData::FlightData(const FlightLog& flight_log, const DriveOptions& drive,
                       const PassOptions& options, const DragMeasurementOptions& drag_measurement)
    : continuous(FindContinuousFixes(flight_log, options.continuous)),
      own_log_(continuous ? WithFixesToFit(flight_log, options.continuous, *continuous) : nullptr),
      log(own_log_ ? *own_log_ : flight_log),
      pass_options(options),
      track(DriveTrack::FromLog(flight_log, drive)),
      forces(AverageForces(flight_log.imu, drag_measurement)) {
  if (log.fixes.empty()) {
    throw ErrorAt(log.directory + "/fixes.csv", 0,
                  "there are no fixes to fit to, and mocap is missing or too short to take their "
                  "place; fly longer, import with fixes, or let trueline convert sample them from "
                  "mocap (fixes_from_mocap)");
  }
  const std::vector<Pass> all = continuous ? DividePasses(log.fixes, pass_options, *continuous)
                                           : FindPasses(log.fixes, pass_options);
  for (const Pass& pass : all) {
    if (track.Covers(pass.begin, pass.end)) {
      passes.push_back(pass);
    } else {
      warnings.push_back(fmt::format(
          "pass at {:.2f} s is left out: imu.csv or attitude.csv has a gap there or does not "
          "reach it",
          SecondsBetween(track.log_start(), pass.begin)));
    }
  }
  const auto covered = [this](const Fix& fix) { return track.Covers(fix.t, fix.t); };
  if (std::none_of(log.fixes.begin(), log.fixes.end(), covered)) {
    throw ErrorAt(log.directory + "/fixes.csv", 0,
                  fmt::format("no fix lies inside of the {:.2f} s that imu.csv and attitude.csv "
                              "cover; the fixes lie from {:.2f} to {:.2f} s after their start. "
                              "Export the whole flight, or bring the clocks together",
                              SecondsBetween(track.begin(), track.end()),
                              SecondsBetween(track.begin(), log.fixes.front().t),
                              SecondsBetween(track.begin(), log.fixes.back().t)));
  }
}

bool FlightData::HasArc(int tau) const {
  if (tau >= static_cast<int>(passes.size())) return false;
  const TimeNs from = passes[tau - 1].end, to = passes[tau].begin;
  return SecondsBetween(from, to) <= pass_options.max_arc && track.Covers(from, to);
}

int FlightData::FirstPassOf(int tau, int gamma, int min_fixes) const {
  int first = tau - 1;
  const auto fixes = [&] { return passes[tau - 1].last - passes[first].first + 1; };
  while (first > 0 && (tau - first < gamma || static_cast<int>(fixes()) < min_fixes) &&
         HasArc(first)) {
    --first;
  }
  return first;
}

std::string FlightData::NoArcReason(int tau) const {
  return fmt::format(
      "the arc after pass {} (at {:.2f} s) is not predicted: it lasts over {} s, or the IMU has "
      "a gap in it",
      tau, SecondsBetween(track.log_start(), passes[tau - 1].end), pass_options.max_arc);
}

ArcPrediction FlightData::ArcAfter(int tau) const {
  const Pass& next = passes[tau];
  ArcPrediction arc;
  arc.begin = passes[tau - 1].end;
  arc.end = next.begin;
  arc.truth_source = "none";
  if (continuous && !continuous->from_mocap) {
    const Fix &last = log.fixes[passes[tau - 1].last], &first = log.fixes[next.first];
    arc.truth = first.p_E.head<2>();
    arc.truth_source = "fixes";
    arc.truth_sigma =
        std::sqrt(continuous->noise.StepVariance(first.sigma, SecondsBetween(last.t, first.t)));
  } else if (const auto truth = TruthAtPass(log, next)) {
    arc.truth = truth->p_E.head<2>();
    arc.truth_source = truth->from_mocap ? "mocap" : "fixes";
    arc.truth_sigma = truth->sigma;
  }
  return arc;
}

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
