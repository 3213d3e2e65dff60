#include "problems/rotor/speed_noise_bias.h"

#include <cmath>

#include "cost_functions/models/rigid_body.h"
#include "problems/common/random.h"

namespace trueline {
namespace {

constexpr int kAgain = 3;  // what is lost of fast changes then biases inertia less than its sigma
constexpr int kPairs = 2;

Eigen::MatrixXd Drawn(const MeasuredSpeeds& measured, Random* random) {
  Eigen::MatrixXd noise(measured.speeds.rows(), measured.speeds.cols());
  for (double& value : noise.reshaped()) value = measured.model.sigma * random->Normal();
  return noise;
}

bool IsBody(const RotorConstants& constants) {
  return constants[kMassConstant] > 0.0 &&
         IsPhysicalInertia(constants.segment<3>(kInertiaConstants));
}

}  // namespace

RotorBatchResult WithoutSpeedNoiseBias(const RotorAeroModel& model, const RotorData& data,
                                       const RotorBatchOptions& options,
                                       const RotorBatchResult& batch, RotorConstants* bias) {
  const MeasuredSpeeds& measured = data.measured;
  if (bias != nullptr) bias->setZero();
  if (measured.model.sigma == 0.0) return batch;
  RotorData trial = data;
  const auto fit = [&](const Eigen::MatrixXd& speeds, const RotorBatchOptions& how,
                       const RotorBatchResult& start) {
    trial.SetSpeeds(SmoothSpeeds(data.speed_times, speeds, measured.model, kAgain));
    return RunRotorBatch(model, trial, how, &start);
  };
  RotorBatchResult corrected = fit(measured.speeds, options, batch);
  RotorBatchOptions mean_only = options;
  mean_only.covariance = false;
  Random random(1, "speed noise");
  RotorConstants moved = RotorConstants::Zero();
  bool fits = std::isfinite(corrected.cost);
  for (int pair = 0; pair < kPairs && fits; ++pair) {
    const Eigen::MatrixXd noise = Drawn(measured, &random);
    for (const double sign : {-1.0, 1.0}) {
      const RotorBatchResult noisier = fit(measured.speeds + sign * noise, mean_only, corrected);
      fits = fits && std::isfinite(noisier.cost);
      moved += (noisier.mean - corrected.mean) / (2.0 * kPairs);
    }
  }
  corrected.mean -= moved;
  if (!fits || !IsBody(corrected.mean)) return batch;
  if (bias != nullptr) *bias = moved;
  return corrected;
}

}  // namespace trueline
