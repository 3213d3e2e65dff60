// Options of the Kalman filter. Defaults are stated only here; the YAML keys are in the mapping
// `ekf` and carry the units.
#pragma once

#include <array>

#include "problems/common/yaml_archive.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

enum class EkfTuning { kConsistent, kPaper };
enum class AttitudeForm { kEuler, kErrorState };
enum class EkfGating { kNone, kChiSquare };

// Initial sigmas for each axis. Biases: the uniform ranges of Table 2 of Li et al. 2019 (width over
// sqrt(12)).
struct EkfStart {
  double position = 5.0;     // m, around a line through the first pass's fixes
  double velocity = 5.0;     // m/s, around that line
  double tilt = 0.040;       // rad, around the AHRS
  double heading = 0.031;    // rad, around the AHRS
  double accel_bias = 0.58;  // m/s^2
  double gyro_bias = 0.030;  // rad/s
};

struct EkfOptions {
  EkfTuning tuning = EkfTuning::kConsistent;
  AttitudeForm attitude = AttitudeForm::kErrorState;
  EkfGating gating = EkfGating::kChiSquare;
  // Fixes with a larger squared Mahalanobis distance are rejected; 16.27 is chi-square's 99.9 % for
  // three degrees of freedom.
  double gate = 16.27;
  // After this many rejections in a row the estimate counts as lost, and the next fix is accepted.
  int max_refusals = 5;
  // Repeats prediction and update across a blind arc around the smoothed state at its start
  // (iterated filter-smoother). A fix is a linear function of the state, so iterating the update
  // alone would change nothing.
  bool iterated = false;

  ImuNoise noise;
  bool gyro_from_log = true;  // whether gyro_scatter is measured on the log, or stays zero
  EkfStart start;

  // The paper's tuning: P0 = 10 I, R = 2.5^2 m^2 for every fix, and Q added at every IMU sample. Q
  // is misprinted in the attitude entries; 3e-8, 3e-9, 3e-9 is the reading that gives 15 entries.
  // Variances for each sample at 512 Hz of p (m^2), v (m^2/s^2), Phi (rad^2).
  std::array<double, 9> paper_q = {2e-6, 2e-6, 5e-6, 1e-5, 5e-6, 3e-5, 3e-8, 3e-9, 3e-9};
  // Of p (m^2), v (m^2/s^2), Phi (rad^2), b_a (m^2/s^4), b_g (rad^2/s^2), the same for three axes.
  std::array<double, 5> paper_p0 = {10.0, 10.0, 10.0, 10.0, 10.0};
  double paper_fix_sigma = 2.5;  // m
  double paper_rate = 512.0;     // Hz
};

void Serialize(YamlArchive* a, EkfOptions* o);

}  // namespace trueline
