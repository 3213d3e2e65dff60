// What all estimators share of one flight; made once, used for every window.
#pragma once

#include <string>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/result/estimate.h"
#include "problems/window/drive_track.h"
#include "problems/window/force_samples.h"
#include "problems/window/passes.h"

namespace trueline {

struct FlightData {
  // Throws InputError where the log has no fixes, or no pass inside of the IMU's time span.
  // `flight_log` must outlive this.
  FlightData(const FlightLog& flight_log, const DriveOptions& drive, const PassOptions& passes,
             const DragMeasurementOptions& drag_measurement);

  // Whether the flight from pass `tau` (from 1) to the next can be integrated: there is a next one,
  // no IMU gap lies between, and it is not so far that the vehicle was elsewhere.
  bool HasArc(int tau) const;

  // First pass (index) of the window that ends with pass `tau`: gamma passes, fewer where the
  // flight begins or has a gap, more where they hold less than `min_fixes` fixes.
  int FirstPassOf(int tau, int gamma, int min_fixes) const;

  // Why the arc after pass `tau` is not predicted, for a warning.
  std::string NoArcReason(int tau) const;

  // The arc after pass `tau`, with its truth; prediction and covariance are left open.
  ArcPrediction ArcAfter(int tau) const;

  const FlightLog& log;
  PassOptions pass_options;
  DriveTrack track;
  std::vector<Pass> passes;
  ForceSamples forces;
  std::vector<std::string> warnings;
};

}  // namespace trueline
