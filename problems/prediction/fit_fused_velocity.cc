#include "problems/prediction/fit_fused_velocity.h"

#include <ceres/autodiff_cost_function.h>

#include <map>
#include <numeric>
#include <string>

#include "problems/prediction/number_fit.h"

namespace trueline {
namespace {

// Velocity, and change of position, of one axis of a run at a frequency.
struct Line {
  double w;  // rad/s
  std::complex<double> velocity, moved;
  int run, trajectory;
};

struct LineResidual {
  Line line;

  template <class T>
  bool operator()(const T* x, T* residuals) const {
    const auto [re, im] = FusedVelocityResponse(x[0], x[1], x[2], line.w);
    const double a = line.moved.real(), b = line.moved.imag();
    residuals[0] = T(line.velocity.real()) - (re * T(a) - im * T(b));
    residuals[1] = T(line.velocity.imag()) - (re * T(b) + im * T(a));
    return true;
  }
};
using LineCost = ceres::AutoDiffCostFunction<LineResidual, 2, 3>;

// Fourier coefficient of x under a Hann window.
std::complex<double> Coefficient(const Eigen::VectorXd& x, double cycles) {
  const double n = static_cast<double>(x.size()), mean = x.mean();
  std::complex<double> sum = 0.0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double phase = 2.0 * M_PI * static_cast<double>(i) / n;
    sum += std::polar((x[i] - mean) * (1.0 - std::cos(phase)), -phase * cycles);
  }
  return sum / n;
}

std::vector<Line> LinesOf(const PredictionRun& run, int run_index, int trajectory) {
  constexpr double kLeast = 0.06, kMost = 1.6, kShortest = 10.0;  // Hz, Hz, s
  constexpr double kStep = FusedVelocity::kStep;
  const Eigen::Index rows = run.states.cols() - 2;
  const double duration = static_cast<double>(rows) * kStep;
  std::vector<Line> lines;
  if (duration < kShortest) return lines;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::VectorXd p = run.states.row(axis), v = run.states.row(3 + axis).segment(1, rows);
    const Eigen::VectorXd moved = (p.tail(rows) - p.head(rows)) / (2.0 * kStep);
    for (int i = static_cast<int>(kLeast * duration) + 1; i < kMost * duration; ++i) {
      lines.push_back({2.0 * M_PI * i / duration, Coefficient(v, i), Coefficient(moved, i),
                       run_index, trajectory});
    }
  }
  return lines;
}

// Every trajectory's squares sum to one.
void Scale(std::vector<Line>* lines) {
  std::map<int, double> power;
  for (const Line& line : *lines) power[line.trajectory] += std::norm(line.velocity);
  for (Line& line : *lines) {
    const double scale = 1.0 / std::sqrt(power[line.trajectory]);
    line.velocity *= scale;
    line.moved *= scale;
  }
}

std::array<double, 3> Sigmas(const std::vector<Line>& lines, const Eigen::Vector3d& x) {
  ClusterVariance by_run(3), by_trajectory(3);
  for (const Line& line : lines) {
    Eigen::Vector2d r;
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J;
    const double* parameters = x.data();
    double* jacobian = J.data();
    LineCost(new LineResidual{line}).Evaluate(&parameters, r.data(), &jacobian);
    by_run.Add(line.run, J.transpose() * r, J.transpose() * J);
    by_trajectory.Add(line.trajectory, J.transpose() * r, J.transpose() * J);
  }
  const Eigen::Vector3d sigma =
      by_run.Diagonal({}).cwiseMax(by_trajectory.Diagonal({})).cwiseSqrt();
  return {sigma[0], sigma[1], sigma[2]};
}

}  // namespace

FusedVelocityFit FitFusedVelocity(const std::vector<const PredictionRun*>& runs,
                                  const FusedVelocityNumbers& start) {
  std::map<std::string, int> trajectories;
  std::vector<Line> lines;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const int next = static_cast<int>(trajectories.size());
    const int trajectory = trajectories.try_emplace(runs[i]->trajectory, next).first->second;
    const std::vector<Line> more = LinesOf(*runs[i], static_cast<int>(i), trajectory);
    lines.insert(lines.end(), more.begin(), more.end());
  }
  if (lines.empty()) return {start, {}};
  Scale(&lines);
  Eigen::Vector3d x(start.excess, start.time, start.lag);
  ceres::Problem problem;
  for (const Line& line : lines) {
    problem.AddResidualBlock(new LineCost(new LineResidual{line}), nullptr, x.data());
  }
  problem.SetParameterLowerBound(x.data(), 1, 0.05);  // s
  problem.SetParameterUpperBound(x.data(), 1, 10.0);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  SolveSilently(options, &problem);
  return {{x[0], x[1], x[2]}, Sigmas(lines, x)};
}

}  // namespace trueline
