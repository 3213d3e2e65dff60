// Prepares a log, and the options, for a diagnosis of the IMU-driven model.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/diagnosis/diagnosis.h"
#include "problems/vgd/vgd.h"

namespace trueline {

struct CalibrationOptions;  // problems/calibration/calibration.h

struct ImuDiagnosisOptions : SearchOptions {
  VgdOptions vgd;
  std::vector<Effect> effects;  // of --model: in the model from the start
  // The priors before those of --model. A flight that contradicts the model's is fitted with these.
  std::optional<MotionPriors> priors_without_model;
  std::vector<std::string> warnings;  // from reading
  bool fit_to_mocap = false;          // mocap positions as data, beside the gates' fixes
};

// The options that a diagnosis shares with a calibration.
ImuDiagnosisOptions DiagnosisOptionsOf(const CalibrationOptions& calibration);

struct PreparedLog {
  FlightLog recorded;
  FlightLog kept;  // without the fixes of a false gate
  // What is fitted: `kept` with the filter's attitude if it has none, and mocap among the fixes
  // (gate -1) if the fit is to mocap.
  FlightLog data;
  ImuDiagnosisOptions options;  // for `data`
  // Of a flight without gates: its fixes count as one gate's (id 0), and are thinned in `data`.
  std::optional<ContinuousFixes> continuous = std::nullopt;
};

// Throws InputError if mocap is missing that the fit needs.
std::shared_ptr<const PreparedLog> PrepareLog(const FlightLog& log,
                                              const ImuDiagnosisOptions& options);

// `fixes`: indices into those of `data`.
std::shared_ptr<const PreparedLog> WithoutFixes(const PreparedLog& log,
                                                const std::vector<std::size_t>& fixes);

// Widens drag's prior: under a tight one any unusual linear drag would look like an effect.
VgdOptions OpenPriors(VgdOptions options);

}  // namespace trueline
