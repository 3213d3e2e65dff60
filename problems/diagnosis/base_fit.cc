#include "problems/diagnosis/base_fit.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "problems/vgd/fix_loss.h"

namespace trueline {
namespace {

constexpr double kHuber = 2.5;  // sigmas, on the norm of a fix's or a force sample's residuals

Eigen::VectorXd RobustWeights(const BaseFlight& flight, const Eigen::VectorXd& r,
                              const NoiseStrengths& noise) {
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(flight.measurement_rows());
  for (int row = 0; row < weight.size();) {
    const bool fix = flight.IsFix(row);
    const int size = fix ? 3 : 2;
    const double sigma = fix ? noise.fix_scale * flight.FixSigma(row) : noise.force_sigma;
    const double norm = r.segment(row, size).norm() / sigma;
    weight.segment(row, size).setConstant(std::sqrt(RobustWeight(FixLoss::kHuber, kHuber, norm)));
    row += size;
  }
  return weight;
}

// Evaluates and linearises all rows at the current unknowns and column values.
void Linearise(BaseFlight* flight, BaseFit* fit) {
  fit->rows = flight->Evaluate(fit->x, true);
  if (fit->columns.count() > 0) fit->rows.r += fit->columns.d_rows * fit->columns.value;
}

// One Gauss-Newton step. Returns its size relative to the posterior (root of the decrease of the
// cost).
double Step(const BaseFlight& flight, BaseFit* fit) {
  const ChainSystem system(fit->Linear(flight), fit->noise);
  const Eigen::MatrixXd border = system.reduced().Fitted();
  const auto nodes = system.chain().NodesAt(border);
  double change = 0.0;
  fit->x.theta += border.col(0).head<kThetaSize>();
  change = border.col(0).head<kThetaSize>().norm();
  fit->columns.value += border.col(0).segment(kThetaSize, fit->columns.count());
  for (std::size_t s = 0; s < nodes.size(); ++s) {
    fit->x.nodes[s] += nodes[s].col(0);
    change = std::max(change, nodes[s].col(0).segment<kStateSize>(kStateAt).norm());
  }
  return change;
}

}  // namespace

NoiseStrengths StartingNoise(const VgdOptions& options) {
  NoiseStrengths noise;
  noise.process = options.process;
  noise.process.gust = 0.05;  // learned even where the options have none
  noise.process.gust_memory = 0.8;
  return noise;
}

void Solve(BaseFlight* flight, int max_iterations, BaseFit* fit) {
  constexpr double kConverged = 2e-3;  // prior sigmas, m, m/s
  if (fit->columns.d_rows.rows() != flight->rows()) fit->columns = Columns::None(flight->rows());
  for (int i = 0; i < max_iterations; ++i) {
    Linearise(flight, fit);
    fit->weight = RobustWeights(*flight, fit->rows.r, fit->noise);
    if (Step(*flight, fit) < kConverged) break;
  }
  Linearise(flight, fit);
  fit->weight = RobustWeights(*flight, fit->rows.r, fit->noise);
}

}  // namespace trueline
