#include "problems/calibration/rotor_conflict.h"

#include <cmath>
#include <limits>

namespace trueline {
namespace {

ParameterPrior PriorOf(const RotorPrior& prior, int constant) {
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  return {prior.mean[constant], prior.sigma[constant], -kUnbounded, kUnbounded};
}

ParameterEstimate EstimateOf(const RotorBatchResult& batch, int constant) {
  const RotorConstantInfo& info = kRotorConstants[constant];
  return {info.name, batch.mean[constant],       batch.Sigma()[constant], info.unit,
          "",        batch.noise_sigma[constant]};
}

bool ChangesPrior(const RotorPrior& model, const RotorPrior& fitted_with, int constant) {
  return model.mean[constant] != fitted_with.mean[constant] ||
         model.sigma[constant] != fitted_with.sigma[constant];
}

}  // namespace

std::vector<Statements> CompareWithModel(const RotorPrior& model, const RotorPrior& fitted_with,
                                         const RotorBatchResult& flight) {
  std::vector<Statements> compared;
  for (const int i : fitted_with.Free()) {
    if (!ChangesPrior(model, fitted_with, i)) continue;
    const auto statements =
        CompareWithModel(PriorOf(model, i), PriorOf(fitted_with, i), EstimateOf(flight, i));
    if (statements) compared.push_back(*statements);
  }
  return compared;
}

bool Contradicts(const RotorPrior& model, const RotorPrior& fitted_with,
                 const RotorBatchResult& flight) {
  const std::vector<Statements> compared = CompareWithModel(model, fitted_with, flight);
  std::vector<int> constants;
  for (const Statements& s : compared) constants.push_back(FindRotorConstant(s.name));
  const Eigen::VectorXd per_sigma = flight.Sigma()(constants).cwiseInverse();
  return ContradictTogether(compared, per_sigma.asDiagonal() *
                                          Eigen::MatrixXd(flight.cov(constants, constants)) *
                                          per_sigma.asDiagonal());
}

RotorPrior WithoutModel(RotorPrior configured, const RotorPrior& with_model) {
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    if (configured.sigma[i] > 0.0 || configured.mean[i] != 0.0) continue;
    if (with_model.sigma[i] > 0.0) {
      configured.sigma[i] = std::abs(with_model.mean[i]) + with_model.sigma[i];
    } else {
      configured.mean[i] = with_model.mean[i];
    }
  }
  return configured;
}

}  // namespace trueline
