// Data of one flight that all estimators and all windows share.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/result/estimate.h"
#include "problems/vgd/drive_track.h"
#include "problems/vgd/force_samples.h"
#include "problems/vgd/passes.h"

namespace trueline {

struct FlightData {
  // Throws InputError if the log has no fixes, or none within the IMU's time span. Isolated fixes
  // (a hover) make no pass: `passes` is then empty. `flight_log` must outlive this object. Fixes
  // without gates are divided by time (continuous_fixes.h); so are mocap's positions in a log
  // without fixes.
  FlightData(const FlightLog& flight_log, const DriveOptions& drive, const PassOptions& passes,
             const DragMeasurementOptions& drag_measurement);

  // True if the flight from pass `tau` (from 1) to the next can be integrated: there is a next
  // pass, no IMU gap lies between, and the arc is not too long.
  bool HasArc(int tau) const;

  // Index of the first pass of the window that ends with pass `tau`: gamma passes; fewer at the
  // flight's start or after a gap, more if they hold less than `min_fixes` fixes.
  int FirstPassOf(int tau, int gamma, int min_fixes) const;

  // Why the arc after pass `tau` is not predicted, for a warning.
  std::string NoArcReason(int tau) const;

  // The arc after pass `tau`, with its truth; prediction and covariance are not filled in.
  ArcPrediction ArcAfter(int tau) const;

  // Set for a flight without gates; `log` then holds the fixes that a fit uses.
  std::optional<ContinuousFixes> continuous;

 private:
  std::shared_ptr<const FlightLog> own_log_;  // null where `log` is the one given

 public:
  const FlightLog& log;
  PassOptions pass_options;
  DriveTrack track;
  std::vector<Pass> passes;
  ForceSamples forces;
  std::vector<std::string> warnings;
};

}  // namespace trueline
