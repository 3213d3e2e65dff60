// Options of the vision-based gradient descent fit (VGD, Li et al. 2019). Defaults are stated only
// here.
#pragma once

#include <array>
#include <string>

#include "cost_functions/models/process_noise.h"
#include "problems/common/units.h"
#include "problems/common/yaml_archive.h"
#include "problems/window/drive_track.h"
#include "problems/window/force_samples.h"
#include "problems/window/passes.h"

namespace trueline {

// Prior of a parameter: normal, with hard bounds, in its own unit.
struct ParameterPrior {
  double mean;
  double sigma;
  double lower;
  double upper;
};

inline bool AtBound(const ParameterPrior& prior, double value) {
  const double margin = 1e-6 * prior.sigma;
  return !(value > prior.lower + margin && value < prior.upper - margin);
}

enum class FixLoss { kHuber, kCauchy, kNone, kNorm };
enum class VgdSolver { kTrustRegion, kGradientDescent };

struct VgdOptions {
  int gamma = 3;  // passes in the window
  // Windows reach further back until they hold this many fixes.
  int min_window_fixes = 8;

  // In the order of eq. 16. Mean and sigma are those of the uniform distributions over the ranges
  // of Table 2 (sigma = width / sqrt(12)). Bounds are twice the ranges; drag may not be positive.
  std::array<ParameterPrior, 9> priors = {{
      {-0.5, 0.29, -2.0, 0.0},                           // K_x, 1/s
      {-0.5, 0.29, -2.0, 0.0},                           // K_y, 1/s
      {0.0, 0.58, -2.0, 2.0},                            // b_az, m/s^2
      {0.0, 1.73 * kDegree, -6 * kDegree, 6 * kDegree},  // phi_E_Ep, rad
      {0.0, 1.73 * kDegree, -6 * kDegree, 6 * kDegree},  // theta_E_Ep
      {0.0, 1.73 * kDegree, -6 * kDegree, 6 * kDegree},  // psi_E_Ep
      {0.0, 1.73 * kDegree, -6 * kDegree, 6 * kDegree},  // phi_I_B
      {0.0, 1.73 * kDegree, -6 * kDegree, 6 * kDegree},  // theta_I_B
      {0.0, 1.73 * kDegree, -6 * kDegree, 6 * kDegree},  // psi_I_B
  }};

  FixLoss loss = FixLoss::kHuber;
  double loss_scale = 2.5;  // in sigmas, on the norm of a fix's three whitened residuals
  bool whiten = true;       // false: residuals in metres, as eq. 29 has them

  // Process noise for model errors. With all of it zero the trajectory is one rigid integration
  // over the window, as in the paper; else its state may change at knots by as much as this noise
  // allows. A complementary filter's tilt error follows manoeuvres with a time constant of its own.
  ProcessNoise process{.acceleration = 0.05,
                       .tilt = 1.5 * kDegree,
                       .heading = 0.5 * kDegree,
                       .memory = 1.0,
                       .gust = 0.06,
                       .gust_memory = 0.8};
  // Learn the sigmas of tilt and gust from the flight, starting at those of `process`.
  bool adapt_drift = true;
  double knot_interval = 0.5;  // s

  DragMeasurementOptions drag_measurement;

  VgdSolver solver = VgdSolver::kTrustRegion;
  int max_iterations = 50;
  double tolerance = 1e-4;  // eq. 36: relative change of the cost
  double max_block = 0.05;  // s, length of a preintegrated block

  PassOptions passes;
  DriveOptions drive;

  // Only the accelerometer distinguishes a gust from a tilt.
  bool UsesGusts() const { return process.Any() && process.gust > 0.0 && drag_measurement.enabled; }
};

// The keys, as config/calibrate/default.yaml states them.
void Serialize(YamlArchive* a, VgdOptions* o);

}  // namespace trueline
