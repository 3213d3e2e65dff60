#include "problems/rotor_diagnosis/rotor_rows.h"

#include <cmath>

namespace trueline {

std::vector<Eigen::Matrix<double, 6, 1>> SegmentDisturbances(const RotorSearch& search) {
  const RotorWorld& world = search.world();
  const RotorBatchResult& batch = search.batch();
  const auto push = [](double, const RotorState&, Eigen::MatrixXd* out) {
    out->setIdentity(12, 6);
  };
  std::vector<Eigen::Matrix<double, 6, 1>> disturbances;
  std::vector<RotorSegment> segments = CutSegments(world.data);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    SegmentModel segment(world.model, world.data, search.noise(), std::move(segments[i]));
    const RotorNode &start = batch.nodes[i], &next = batch.nodes[i + 1];
    segment.SetWeight(start, batch.mean);
    SegmentResidual residual = segment.Evaluate(start, next, batch.mean, false);
    segment.Whiten(&residual);
    Eigen::MatrixXd response = segment.Respond(start, next, batch.mean, 6, push);
    segment.Whiten(&response);
    Eigen::Matrix<double, 6, 1> sigmas;
    for (int j = 0; j < 6; ++j) {
      sigmas[j] = -response.col(j).dot(residual.error) / response.col(j).norm();
    }
    disturbances.push_back(sigmas);
  }
  return disturbances;
}

double WhitenessOf(const std::vector<double>& times,
                   const std::vector<Eigen::Matrix<double, 6, 1>>& disturbances) {
  constexpr double kBlock = 0.5;  // s; pose noise correlates neighbours within a block
  double products = 0.0, squares = 0.0;
  Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero(), last = sum;
  double end = times.front() + kBlock;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (times[i] >= end) {
      const Eigen::Matrix<double, 6, 1> product = last.cwiseProduct(sum);
      products += product.sum();
      squares += product.squaredNorm();  // its variance, also under heavy tails
      last = sum;
      sum.setZero();
      end = times[i] + kBlock;
    }
    sum += disturbances[i];
  }
  return squares > 0.0 ? 0.5 * std::erfc(products / std::sqrt(2.0 * squares)) : 1.0;
}

}  // namespace trueline
