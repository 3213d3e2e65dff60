#include "problems/diagnosis/base_fit.h"

#include <cmath>

#include "cost_functions/huber.h"
#include "problems/chain/damped_gauss_newton.h"
#include "problems/vgd/solver_options.h"

namespace trueline {
namespace {

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
    weight.segment(row, size).setConstant(std::sqrt(HuberWeight(kForceHuber, norm)));
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
    sum += HuberCost(kForceHuber, norm);
  });
  return 0.5 * sum + ProcessCost(flight, rows, x, noise);
}

// The base fit as a problem for MinimiseDamped.
class FitProblem {
 public:
  FitProblem(BaseFlight* flight, BaseFit* fit) : flight_(flight), fit_(fit) {
    Relinearise();
    value_ = trueline::Cost(*flight_, fit_->rows, fit_->x, fit_->columns, fit_->noise);
  }

  double Cost() const { return value_; }

  double Linearise() {
    if (!linearised_) Relinearise();
    linearised_ = false;
    const LinearFlight linear = fit_->Linear(*flight_);
    const ChainSystem system(linear, fit_->noise);
    const Eigen::VectorXd border = system.reduced().Fitted();
    step_ = {{}, border.segment(kThetaSize, fit_->columns.count())};
    step_.x.theta = border.head<kThetaSize>();
    size_ = step_.x.theta.norm();
    const std::vector<Eigen::MatrixXd> nodes = system.chain().NodesAt(border);
    for (const Eigen::MatrixXd& node : nodes) {
      step_.x.nodes.emplace_back(node);
      size_ = std::max(size_, node.col(0).segment<kStateSize>(kStateAt).norm());
    }
    start_ = {fit_->x, fit_->columns.value};
    const ReducedSystem::Prior prior = BorderPrior(linear);
    return system.chain().SlopeTo(nodes, border) +
           prior.precision.cwiseProduct(prior.error).dot(border.head(system.border()));
  }

  bool Try(double part, double* cost) {
    fit_->x.theta = start_.x.theta + part * step_.x.theta;
    for (std::size_t s = 0; s < start_.x.nodes.size(); ++s) {
      fit_->x.nodes[s] = start_.x.nodes[s] + part * step_.x.nodes[s];
    }
    fit_->columns.value = start_.columns + part * step_.columns;
    *cost = trueline::Cost(*flight_, RowsAt(flight_, fit_->x, fit_->columns, false), fit_->x,
                           fit_->columns, fit_->noise);
    return true;
  }

  void Return() {
    fit_->x = start_.x;
    fit_->columns.value = start_.columns;
  }

  bool IsSettled(double /*before*/, double /*after*/, double part) const {
    constexpr double kSettled = 2e-3;  // prior sigmas, m, m/s
    return part * size_ < kSettled;
  }

  // Rows, derivatives and robust weights at the current unknowns.
  void Relinearise() {
    fit_->rows = RowsAt(flight_, fit_->x, fit_->columns, true);
    fit_->weight = RobustWeights(*flight_, fit_->rows.r, fit_->noise);
    linearised_ = true;
  }

 private:
  struct Point {
    FlightUnknowns x;
    Eigen::VectorXd columns;
  };

  BaseFlight* flight_;
  BaseFit* fit_;
  Point start_, step_;
  double value_ = 0.0, size_ = 0.0;  // size: of the step, its largest change
  bool linearised_ = false;
};

}  // namespace

NoiseStrengths StartingNoise(const VgdOptions& options) {
  NoiseStrengths noise;
  noise.process = options.process;
  noise.process.gust = 0.05;  // learned even where the options have none
  noise.process.gust_memory = 0.8;
  return noise;
}

void Solve(BaseFlight* flight, int max_iterations, BaseFit* fit) {
  if (fit->columns.d_rows.rows() != flight->rows()) fit->columns = Columns::None(flight->rows());
  FitProblem problem(flight, fit);
  MinimiseDamped(&problem, max_iterations);
  problem.Relinearise();
}

}  // namespace trueline
