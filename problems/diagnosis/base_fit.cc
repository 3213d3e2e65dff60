#include "problems/diagnosis/base_fit.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "problems/vgd/fix_loss.h"

namespace trueline {
namespace {

constexpr double kHuber = 2.5;  // sigmas, on the norm of a fix's or a force sample's residuals

// Calls visit(first row, rows, sigma) for every fix and force sample.
template <class Visit>
void ForEachMeasurement(const BaseFlight& flight, const NoiseStrengths& noise, Visit&& visit) {
  for (int row = 0; row < flight.measurement_rows();) {
    const int size = flight.IsFix(row) ? 3 : 2;
    visit(row, size,
          flight.IsFix(row) ? noise.fix_scale * flight.FixSigma(row) : noise.force_sigma);
    row += size;
  }
}

Eigen::VectorXd RobustWeights(const BaseFlight& flight, const Eigen::VectorXd& r,
                              const NoiseStrengths& noise) {
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(flight.measurement_rows());
  ForEachMeasurement(flight, noise, [&](int row, int size, double sigma) {
    const double norm = r.segment(row, size).norm() / sigma;
    weight.segment(row, size).setConstant(std::sqrt(RobustWeight(FixLoss::kHuber, kHuber, norm)));
  });
  return weight;
}

FlightRows RowsAt(BaseFlight* flight, const FlightUnknowns& x, const Columns& columns,
                  bool derivatives) {
  FlightRows rows = flight->Evaluate(x, derivatives);
  if (columns.count() > 0) rows.r += columns.d_rows * columns.value;
  return rows;
}

// Half of Huber's loss over all measurements, of the process and of the priors.
double Cost(const BaseFlight& flight, const FlightRows& rows, const FlightUnknowns& x,
            const Columns& columns, const NoiseStrengths& noise) {
  double sum = x.theta.squaredNorm() + columns.precision.dot(columns.value.cwiseAbs2());
  ForEachMeasurement(flight, noise, [&](int row, int size, double sigma) {
    const double norm = rows.r.segment(row, size).norm() / sigma;
    sum += norm <= kHuber ? norm * norm : kHuber * (2.0 * norm - kHuber);
  });
  return 0.5 * sum + ProcessCost(flight, rows, x, noise);
}

struct Step {
  FlightUnknowns x;
  Eigen::VectorXd columns;
  double size;  // the largest change: prior sigmas, m, m/s
};

// The Gauss-Newton step of all unknowns.
Step GaussNewtonStep(const BaseFlight& flight, const BaseFit& fit) {
  const ChainSystem system(fit.Linear(flight), fit.noise);
  const Eigen::VectorXd border = system.reduced().Fitted();
  Step step{{}, border.segment(kThetaSize, fit.columns.count()), 0.0};
  step.x.theta = border.head<kThetaSize>();
  step.size = step.x.theta.norm();
  for (const Eigen::MatrixXd& node : system.chain().NodesAt(border)) {
    step.x.nodes.emplace_back(node);
    step.size = std::max(step.size, node.col(0).segment<kStateSize>(kStateAt).norm());
  }
  return step;
}

// Moves by the part of the step that lowers the cost: the whole, a half, a quarter, ... Returns the
// size of the move; zero if no part does.
double Move(BaseFlight* flight, const Step& step, BaseFit* fit) {
  constexpr double kLeast = 1.0 / 64.0;
  const double before = Cost(*flight, fit->rows, fit->x, fit->columns, fit->noise);
  for (double part = 1.0; part >= kLeast; part *= 0.5) {
    FlightUnknowns x = fit->x;
    x.theta += part * step.x.theta;
    for (std::size_t s = 0; s < x.nodes.size(); ++s) x.nodes[s] += part * step.x.nodes[s];
    Columns columns = fit->columns;
    columns.value += part * step.columns;
    const double after = Cost(*flight, RowsAt(flight, x, columns, false), x, columns, fit->noise);
    if (!(after < before)) continue;
    fit->x = std::move(x);
    fit->columns.value = columns.value;
    return part * step.size;
  }
  return 0.0;
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
  const auto linearise = [&] {
    fit->rows = RowsAt(flight, fit->x, fit->columns, true);
    fit->weight = RobustWeights(*flight, fit->rows.r, fit->noise);
  };
  linearise();
  for (int i = 0; i < max_iterations; ++i) {
    const double moved = Move(flight, GaussNewtonStep(*flight, *fit), fit);
    if (moved > 0.0) linearise();
    if (moved < kConverged) break;
  }
}

}  // namespace trueline
