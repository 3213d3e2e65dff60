// Options of the vision-based gradient descent fit (VGD, Li et al. 2019). Defaults are stated only
// here.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <string_view>

#include "cost_functions/models/imu_driven_model.h"
#include "cost_functions/models/process_noise.h"
#include "problems/common/units.h"
#include "problems/common/yaml_archive.h"
#include "problems/vgd/drive_track.h"
#include "problems/vgd/force_samples.h"
#include "problems/vgd/passes.h"

namespace trueline {

// The unit of a parameter's prior in kTheta and in files: degrees for angles.
inline double FileUnit(int parameter) {
  return std::string_view(kTheta[parameter].unit) == "rad" ? kDegree : 1.0;
}
using MotionPriors = std::array<ParameterPrior, kMotionSize>;
// In the parameters' own units.
inline MotionPriors DefaultPriors() {
  MotionPriors priors;
  for (int i = 0; i < kMotionSize; ++i) {
    const auto& [mean, sigma, lower, upper] = kTheta[i].prior;
    const double unit = FileUnit(i);
    priors[i] = {unit * mean, unit * sigma, unit * lower, unit * upper};
  }
  return priors;
}

inline bool AtBound(const ParameterPrior& prior, double value) {
  const double margin = 1e-6 * prior.sigma;
  return !(value > prior.lower + margin && value < prior.upper - margin);
}

enum class FixLoss { kHuber, kCauchy, kNone, kNorm };
// The trust region is Levenberg-Marquardt. The other two are line searches (Wolfe's conditions)
// without bounds: eq. 31, and the quasi-Newton method of general minimisers such as FMINCON.
enum class VgdSolver { kTrustRegion, kGradientDescent, kBfgs };
// What a parameter's range is used for: prior and bounds, bounds alone, or the search's start
// alone.
enum class RangeUse { kPrior, kBounds, kStart };
// Where a window's search begins: at the window before, the priors' means, or drawn from the
// ranges.
enum class SearchStart { kPrevious, kMean, kRandom };

struct VgdOptions {
  int gamma = 3;  // passes in the window
  // Windows reach further back until they hold this many fixes.
  int min_window_fixes = 8;

  // Of the parameters of the equation of motion, in the order of theta.
  MotionPriors priors = DefaultPriors();
  RangeUse ranges = RangeUse::kPrior;
  SearchStart start = SearchStart::kPrevious;
  int start_seed = 1;  // of random starts

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

  // Of any parameter in theta.
  ParameterPrior PriorOf(int parameter) const {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    if (parameter < kMotionSize) return priors[parameter];
    if (parameter >= kFilterInTheta) return kTheta[parameter].prior;
    return {0.0, drag_measurement.bias_sigma, -kNone, kNone};
  }

  bool HasBounds() const { return ranges != RangeUse::kStart && solver == VgdSolver::kTrustRegion; }

  // Then noise along the thrust is the accelerometer's, and has a strength of its own.
  bool MeasuresThrust() const { return drive.thrust != ThrustSource::kLevelFlight; }
  // Only the accelerometer distinguishes a gust from a tilt.
  bool UsesGusts() const { return process.Any() && process.gust > 0.0 && drag_measurement.enabled; }
};

// The keys, as config/calibrate/default.yaml states them.
void Serialize(YamlArchive* a, VgdOptions* o);

// Noise of an IMU between fixes, as root spectral densities for each axis.
struct ImuNoise {
  double accel = 0.02;        // m/s^2/sqrt(Hz)
  double gyro = 0.001;        // rad/s/sqrt(Hz)
  double accel_walk = 0.002;  // m/s^3/sqrt(Hz), of the Wiener process b_a
  double gyro_walk = 1e-4;    // rad/s^2/sqrt(Hz), of the Wiener process b_g
  // rad/s/sqrt(Hz), GyroScatter's value for the log; the larger of this and `gyro` applies.
  Eigen::Vector3d gyro_scatter = Eigen::Vector3d::Zero();

  // rad^2/s^2/Hz for each axis of I.
  Eigen::Vector3d GyroSpectrum() const { return gyro_scatter.cwiseMax(gyro).cwiseAbs2(); }
};

// Options of VGD-kinematic in addition to those it shares with VGD (window, loss, solver, passes);
// the YAML keys are in the mapping `kinematic`.

// Zero-mean priors, with hard bounds at kBoundSigmas, as VGD's. Biases by the uniform ranges of
// Table 2 in Li et al. 2019 (+-1 m/s^2, +-3 deg/s; sigma is width over sqrt(12)).
struct KinematicOptions {
  // The attitude at the window's start as an unknown, with the AHRS's as mean. The paper (eq. 38)
  // assumes that the AHRS is exact there.
  bool initial_attitude = true;
  double accel_bias_sigma = 0.58;  // m/s^2
  double gyro_bias_sigma = 0.030;  // rad/s
  double tilt_sigma = 0.040;       // rad
  double heading_sigma = 0.031;    // rad
  static constexpr double kBoundSigmas = 3.46;
  // Widens the covariance only; the fit itself is the paper's rigid one. Only white noise is used.
  ImuNoise noise;
  bool gyro_from_log = true;  // whether noise.gyro_scatter is measured on the log
};

void Serialize(YamlArchive* a, KinematicOptions* o);

}  // namespace trueline
