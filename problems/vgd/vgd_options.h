// Options of the vision-based gradient descent fit (VGD, Li et al. 2019). Defaults are stated here
// and nowhere else; ReadVgdOptions takes the same names from YAML.
#pragma once

#include <array>
#include <string>

#include "cost_functions/models/process_noise.h"
#include "problems/common/strict_yaml.h"
#include "problems/window/drive_track.h"
#include "problems/window/passes.h"

namespace trueline {

// What is known of a parameter before the flight: a normal prior and hard bounds, in its own unit.
struct ParameterPrior {
  double mean;
  double sigma;
  double lower;
  double upper;
};

enum class FixLoss { kHuber, kCauchy, kNone, kNorm };
enum class VgdSolver { kTrustRegion, kGradientDescent };

// Use of the accelerometer's x and y axes, which the paper's fit leaves aside.
struct DragMeasurementOptions {
  bool enabled = true;
  double interval = 0.05;   // s, over which the accelerometer is averaged
  // m/s^2, of such a mean, for what drag does not explain; the larger of this and the scatter of
  // neighbouring means is used, so that a vibrating or poor accelerometer weighs less.
  double sigma = 0.2;
  double bias_sigma = 1.0;  // m/s^2, prior of b_ax and b_ay
};

inline constexpr double kDegree = 0.017453292519943295;  // rad

struct VgdOptions {
  int gamma = 3;  // passes in the window
  // Windows reach further back until they hold this many fixes.
  int min_window_fixes = 8;

  // In the order of eq. 16. Mean and sigma from the ranges of Table 2 (their middle and half
  // width: weak), bounds at twice those ranges.
  std::array<ParameterPrior, 9> priors = {{
      {-0.5, 0.5, -1.5, 0.5},                             // K_x, 1/s
      {-0.5, 0.5, -1.5, 0.5},                             // K_y, 1/s
      {0.0, 1.0, -2.0, 2.0},                              // b_az, m/s^2
      {0.0, 3 * kDegree, -6 * kDegree, 6 * kDegree},      // phi_E_Ep, rad
      {0.0, 3 * kDegree, -6 * kDegree, 6 * kDegree},      // theta_E_Ep
      {0.0, 3 * kDegree, -6 * kDegree, 6 * kDegree},      // psi_E_Ep
      {0.0, 3 * kDegree, -6 * kDegree, 6 * kDegree},      // phi_I_B
      {0.0, 3 * kDegree, -6 * kDegree, 6 * kDegree},      // theta_I_B
      {0.0, 3 * kDegree, -6 * kDegree, 6 * kDegree},      // psi_I_B
  }};

  FixLoss loss = FixLoss::kHuber;
  double loss_scale = 2.5;  // in sigmas, on the norm of a fix's three whitened residuals
  bool whiten = true;       // false: residuals in metres, as eq. 29 has them

  // What the model lacks. With all of it zero the trajectory is one rigid integration over the
  // window, as in the paper; else it may bend at knots, as much as this noise allows.
  // A complementary filter's tilt error follows manoeuvres with its own time constant.
  ProcessNoise process{
      .acceleration = 0.05, .tilt = 1.5 * kDegree, .heading = 0.5 * kDegree, .memory = 1.0};
  double knot_interval = 0.5;  // s

  DragMeasurementOptions drag_measurement;

  VgdSolver solver = VgdSolver::kTrustRegion;
  int max_iterations = 50;
  double tolerance = 1e-4;  // eq. 36: relative change of the cost
  double max_block = 0.03;  // s, length of a preintegrated block

  PassOptions passes;
  DriveOptions drive;
};

// Reads the keys of `map` (see config/calibrate/default.yaml) over the defaults; strict.
VgdOptions ReadVgdOptions(const YamlMap& map);

// All options with their values, for the provenance of a result; ReadVgdOptions reads it back.
YAML::Node ToYaml(const VgdOptions& options);

}  // namespace trueline
