// Calibration of one flight by the rotor-driven model: log in; constants with intervals, a verdict,
// the filter's estimates over time, and the prediction error on held-out flight.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/calibration/calibration.h"
#include "problems/effects/declaration.h"
#include "problems/result/statistics.h"
#include "problems/rotor/rotor_batch.h"
#include "problems/rotor/rotor_ekf.h"

namespace trueline {

// Open-loop prediction on held-out flight: from the filter's state at one time, rotor speeds alone
// predict the position a horizon later.

struct OpenLoopError {
  double t;        // s, of the start
  double horizon;  // s
  double error;    // m, between predicted and measured position of P
};

// Predictions start every `spacing` seconds, after one second in which the filter converges. Their
// initial states come from a filter that holds `calibrated`; the prediction uses `constants`. Empty
// if that filter diverges.
std::vector<OpenLoopError> PredictOpenLoop(const RotorAeroModel& model, const RotorData& data,
                                           const RotorNoise& noise,
                                           const RotorConstants& calibrated,
                                           const RotorConstants& constants,
                                           const std::vector<double>& horizons, double spacing);

// The same with the filter's constants, and how large the filter states the error to be.
std::vector<RotorForecast> ForecastOpenLoop(const RotorAeroModel& model, const RotorData& data,
                                            const RotorNoise& noise,
                                            const RotorConstants& calibrated,
                                            const std::vector<double>& horizons, double spacing);

// An unmodelled effect and its usual size; see considered.h.
struct ConsideredEffect {
  std::string id, parameter;
  double sigma;  // mean zero, in the catalogue's unit
};

struct RotorCalibrationOptions {
  RotorVehicle vehicle;  // rotors, and nominal constants
  RotorPrior prior;
  RotorNoise noise;
  RotorDataOptions data;
  std::vector<Effect> effects;  // from a diagnosis; `prior` and `data` already hold those of their
                                // values that are constants or a motor lag
  double hold_out = 0.25;       // share of the flight, at its end, that predictions are judged on
  bool learn_noise = true;      // from the flight (learn_rotor_noise.h); else use `noise`
  bool learn_rotor_delay = false;  // on top of data.rotor_delay
  bool learn_gyro_delay = false;   // near data.gyro_delay
  double robust_pose = 3.0;        // sigmas, see RotorBatchOptions
  bool widen = true;               // see RotorBatchOptions
  std::vector<ConsideredEffect> considered;
  double wander = 0.0;                // random walk of the filter's constants, see RotorEkfOptions
  std::vector<std::string> warnings;  // from reading
  // The prior before that of the model (--model), which takes its place if the flight contradicts
  // the model's constants.
  std::optional<RotorPrior> prior_without_model;
  // What `effects` added to the means of both priors.
  RotorConstants of_effects = RotorConstants::Zero();

  explicit RotorCalibrationOptions(RotorVehicle nominal)
      : vehicle(std::move(nominal)), prior(PriorFromVehicle(vehicle)) {}
};

struct HorizonScore {
  double horizon;  // s
  int count = 0;
  double before = 0.0;  // m, mean error with the nominal constants
  double after = 0.0;   // m, with the calibrated ones
  double after_rms = 0.0;
  // Radii of the regions that hold `kRegionLevels` of such predictions, learned on the fitted part
  // of the flight (m), and the share of the held-out ones inside. What a model lacks repeats from
  // one part to the other; the noise alone does not know it.
  std::array<double, kRegionLevels.size()> radius = {}, inside = {};
  double inside_noise = 0.0;  // share inside the 95 % ellipsoid that the filter's noise gives
};

struct RotorCalibration {
  RotorBatchResult batch;
  // What the flight alone shows: the batch with the prior without the model. None without such a
  // prior, or where that fit finds no solution.
  std::optional<RotorBatchResult> alone;
  RotorEkfRun filter;
  RotorNoise noise;                            // used
  double rotor_delay = 0.0, gyro_delay = 0.0;  // s, used
  double speed_sigma = 0.0;                    // rad/s, learned noise of a sample of rotors.csv
  RotorConstants speed_noise_bias = RotorConstants::Zero();  // that this noise caused; subtracted
  std::vector<ParameterEstimate> parameters;                 // the batch's
  std::vector<std::string> unobservable;
  std::vector<Effect> effects;  // of the model, beyond `parameters`
  std::vector<HorizonScore> predictions;
  std::vector<RotorForecast> open_loop;  // with the calibrated constants; times as `pose_times`
  std::vector<double> pose_times;        // s, of the batch's nodes
  TimeNs origin = 0;                     // that times count from
  double chi_square = 0.0;               // whitened squares by degree of freedom
  double halves = 0.0;  // largest difference between the fits to each half, in its sigma
  std::string halves_parameter;
  // "name (sigmas)", beyond three: constants of the vehicle, and biases, which drift.
  std::vector<std::string> halves_disagree, biases_differ;
  Verdict verdict;
  std::vector<std::string> warnings;
};
// Of the poses, if their delay is one of the constants that were fitted.
std::vector<StreamDelay> DelaysOf(const RotorCalibration& calibration);

// The model of the vehicle with its effects.
RotorAeroModel ModelFor(const RotorCalibrationOptions& options, const FlightLog& log);

// What of the effects the constants that `prior` frees do not state.
std::vector<Effect> EffectsBesideConstants(const std::vector<Effect>& effects,
                                           const RotorPrior& prior);

// With a model (--model) as far as the flight does not contradict it: CalibrationWithModel. `used`,
// if not null, becomes the options used. Throws InputError for logs that lack a required stream or
// are too short.
RotorCalibration CalibrateRotors(const FlightLog& log, const RotorCalibrationOptions& options,
                                 RotorCalibrationOptions* used = nullptr);

// The parameters with their status, and the combinations that are unobservable on the flight.
void DescribeConstants(const RotorBatchResult& batch, const RotorPrior& prior,
                       std::vector<ParameterEstimate>* parameters,
                       std::vector<std::string>* unobservable);

}  // namespace trueline
