// Data of one flight that all estimators and all windows share, and the part of it that a window
// covers.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/result/estimate.h"
#include "problems/vgd/drive_track.h"
#include "problems/vgd/force_samples.h"
#include "problems/vgd/passes.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

struct FlightData {
  // Throws InputError if the log has no fixes, or none within the IMU's time span. Isolated fixes
  // (a hover) make no pass: `passes` is then empty. `flight_log` must outlive this object. Fixes
  // without gates are divided by time (passes.h); so are mocap's positions in a log
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

// A pass whose fixes share an unknown error: an offset and its constant rate.
struct PassOffset {
  int pass;           // index among the window's passes
  double sigma;       // m, prior of the offset for each axis
  double rate_sigma;  // m/s, prior of its rate
};

struct WindowData {
  TimeNs begin;                // of the first fix
  TimeNs end;                  // of the predicted arc (or of the last fix where none follows)
  std::span<const Fix> fixes;  // within [begin, end]
  std::span<const Pass> passes;
  std::span<const ForceSample> forces;
  double force_sigma;               // m/s^2
  std::vector<PassOffset> offsets;  // of the passes that have one, ascending
  FixNoise noise = {};              // of fixes without gates
};

// The start of a solve: the parameters of eq. 16 in their own units.
using Theta = Eigen::Matrix<double, kMotionSize, 1>;

// Data from pass `first` (from 0) through pass `tau` (from 1), and to the end of the arc after it
// if `with_arc` and there is one. Points into `flight`.
WindowData CutWindow(const FlightData& flight, const VgdOptions& options, int first, int tau,
                     bool with_arc);
// The same up to `end`, which lies on the arc after pass `tau` or at its ends.
WindowData CutWindowUntil(const FlightData& flight, const VgdOptions& options, int first, int tau,
                          TimeNs end);

}  // namespace trueline
