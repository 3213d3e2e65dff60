#include "problems/vgd/vgd_kinematic.h"

#include <cmath>

#include "problems/common/random.h"
#include "problems/result/identifiability.h"
#include "problems/vgd/drive_track.h"
#include "problems/vgd/kinematic_window.h"
#include "problems/vgd/rough_path.h"
#include "problems/vgd/window_estimate.h"

namespace trueline {
namespace {

using Biases = Eigen::Matrix<double, kImuBiasSize, 1>;

void StoreParameters(const KinematicWindow& window, bool bounded, const Eigen::MatrixXd& cov_all,
                     WindowEstimate* estimate) {
  const int count = window.free_parameters();
  std::vector<std::string> names(std::begin(kImuBiasNames), std::end(kImuBiasNames));
  std::vector<std::string> units(std::begin(kImuBiasUnits), std::end(kImuBiasUnits));
  for (int i = kAhrsInTheta; static_cast<int>(names.size()) < count; ++i) {
    names.emplace_back(kTheta[i].name);
    units.emplace_back(kTheta[i].unit);
  }
  const Eigen::VectorXd prior = window.prior_sigma().head(count);
  const Eigen::MatrixXd cov = cov_all.topLeftCorner(count, count);
  const Identifiability shown = AnalyseIdentifiability(names, units, prior, cov);
  estimate->unobservable = shown.combinations;
  const KinematicWindow::Theta value = window.Parameters();
  for (int i = 0; i < count; ++i) {
    const bool at_bound =
        bounded && std::abs(value[i]) > prior[i] * (KinematicOptions::kBoundSigmas - 1e-6);
    estimate->parameters.push_back({names[i], value[i], prior[i] * std::sqrt(cov(i, i)), units[i],
                                    at_bound ? "at_bound" : shown.status[i]});
  }
}

void StoreTrajectory(const KinematicWindow& window, const Pass& pass, WindowEstimate* estimate) {
  for (std::size_t i = 0; i < window.times().size(); ++i) {
    const TimeNs t = window.times()[i];
    if (t < pass.begin) continue;
    const auto& x = window.nodes()[i].value;
    auto& points = t <= pass.end ? estimate->fitted : estimate->predicted;
    points.push_back({t, x.head<3>(), x.tail<3>()});
  }
}

void SetStart(const FlightData& flight, int first, int tau, const Biases& biases,
              KinematicWindow* window) {
  const auto passes = std::span(flight.passes).subspan(first, tau - first);
  const LineFit line = RoughPath(flight.log.fixes, passes).At(passes.front().begin);
  KinematicWindow::Theta theta = KinematicWindow::Theta::Zero();
  theta.head<kImuBiasSize>() = biases;
  KinematicWindow::State state;
  state << line.p, line.v;
  window->SetStart(theta, state);
}

// Drawn from the ranges of Table 2: +- sqrt(3) sigma.
Biases RandomBiases(const KinematicOptions& options, Random* random) {
  Biases biases;
  for (int i = 0; i < kImuBiasSize; ++i) {
    const double sigma = i < 3 ? options.accel_bias_sigma : options.gyro_bias_sigma;
    biases[i] = std::sqrt(3.0) * sigma * random->Uniform(-1.0, 1.0);
  }
  return biases;
}

Biases BiasesOf(const WindowEstimate& estimate) {
  Biases biases;
  for (int i = 0; i < kImuBiasSize; ++i) biases[i] = estimate.parameters[i].value;
  return biases;
}

}  // namespace

WindowEstimate SolveKinematicWindow(const FlightData& flight, const ImuInputs& imu,
                                    const VgdOptions& vgd, const KinematicOptions& options, int tau,
                                    const Biases& start_biases) {
  const int first = flight.FirstPassOf(tau, vgd.gamma, vgd.min_window_fixes);
  const Pass &from = flight.passes[first], &to = flight.passes[tau - 1];
  const auto fixes = std::span(flight.log.fixes).subspan(from.first, to.last - from.first + 1);
  const bool has_arc = flight.HasArc(tau);
  KinematicWindow window(imu, fixes, has_arc ? flight.passes[tau].begin : to.end, vgd, options);
  SetStart(flight, first, tau, start_biases, &window);
  const ceres::Solver::Summary summary = window.Solve();

  WindowEstimate estimate;
  estimate.tau = tau;
  estimate.gamma = tau - first;
  estimate.begin = from.begin;
  estimate.end = to.end;
  estimate.iterations = static_cast<int>(summary.iterations.size()) - 1;
  estimate.converged = summary.termination_type == ceres::CONVERGENCE;
  estimate.cost = summary.final_cost;
  estimate.solve_time = summary.total_time_in_seconds;
  const Eigen::MatrixXd cov = window.Covariance();
  const bool bounded = vgd.ranges != RangeUse::kStart;
  StoreParameters(window, bounded, cov, &estimate);
  const auto position_at = [&](TimeNs t) { return window.PositionAt(t); };
  StoreMisfits(fixes, vgd, position_at, &estimate);
  StoreTrajectory(window, to, &estimate);
  if (has_arc) {
    ArcPrediction arc = flight.ArcAfter(tau);
    arc.p_E = window.nodes().back().value.head<2>();
    arc.cov = cov.block<2, 2>(kKinematicThetaSize, kKinematicThetaSize);
    estimate.arc = arc;
  }
  return estimate;
}

EstimatorRun RunVgdKinematic(const FlightData& flight, const VgdOptions& vgd,
                             const KinematicOptions& options) {
  EstimatorRun run{"vgd_kinematic", vgd.gamma, {}, flight.warnings};
  const ImuInputs imu(flight.log, flight.track);
  KinematicOptions with_noise = options;
  if (options.gyro_from_log) with_noise.noise.gyro_scatter = GyroScatter(imu);
  Biases start = Biases::Zero();
  Random random(vgd.start_seed, "kinematic window starts");
  const int passes = static_cast<int>(flight.passes.size());
  for (int tau = 1; tau <= passes; ++tau) {
    if (vgd.start == SearchStart::kRandom) start = RandomBiases(options, &random);
    run.windows.push_back(SolveKinematicWindow(flight, imu, vgd, with_noise, tau, start));
    const bool follows = vgd.start == SearchStart::kPrevious && run.windows.back().converged;
    if (follows) start = BiasesOf(run.windows.back());
    if (tau < passes && !run.windows.back().arc) run.warnings.push_back(flight.NoArcReason(tau));
  }
  return run;
}

}  // namespace trueline
