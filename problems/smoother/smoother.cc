#include "problems/smoother/smoother.h"

#include <Eigen/Dense>

#include "problems/common/error.h"
#include "problems/common/yaml_options.h"
#include "problems/vgd/drift_strength.h"
#include "problems/vgd/vgd.h"
#include "problems/vgd/window_data.h"
#include "problems/vgd/window_estimate.h"

namespace trueline {
namespace {

using Prior = WindowPrior;
using PriorMatrix = Eigen::Matrix<double, Prior::kSize, Prior::kSize>;

PriorMatrix CovarianceOf(const Prior& prior) {
  const PriorMatrix information = prior.sqrt_information.transpose() * prior.sqrt_information;
  return information.ldlt().solve(PriorMatrix::Identity());
}

void SetCovariance(const PriorMatrix& cov, Prior* prior) {
  const PriorMatrix L = cov.llt().matrixL();
  prior->sqrt_information = L.triangularView<Eigen::Lower>().solve(PriorMatrix::Identity());
}

// Lets the shared parameters walk for `seconds`.
void Loosen(const SmootherOptions& options, const ParameterScaling& scaling, double seconds,
            Prior* prior) {
  Eigen::Matrix<double, kThetaSize, 1> walk = Eigen::Matrix<double, kThetaSize, 1>::Zero();
  for (const int i : {2, 9, 10}) walk[i] = options.accel_bias_walk;
  walk.segment<3>(kAhrsInTheta).setConstant(options.ahrs_error_walk);
  if (walk.isZero()) return;
  PriorMatrix cov = CovarianceOf(*prior);
  cov.diagonal().head<kThetaSize>() += walk.cwiseQuotient(scaling.sigma).cwiseAbs2() * seconds;
  SetCovariance(cov, prior);
}

// After a break: what is known of theta stays, drift starts anew, and the state is open.
Prior KeepParameters(const Prior& past, const VgdOptions& vgd, const LineFit& start) {
  constexpr double kOpen = 100.0;  // m and m/s
  Prior prior;
  prior.mean << past.mean.head<kThetaSize>(), Eigen::Vector3d::Zero(), start.p, start.v;
  PriorMatrix cov = PriorMatrix::Zero();
  cov.topLeftCorner<kThetaSize, kThetaSize>() =
      CovarianceOf(past).topLeftCorner<kThetaSize, kThetaSize>();
  const Eigen::Vector3d drift =
      vgd.process.DriftSigma().cwiseMax(1e-5).cwiseQuotient(ParameterScaling(vgd).DriftUnit());
  cov.diagonal().segment<kDriftSize>(kThetaSize) = drift.cwiseAbs2();
  cov.diagonal().tail<kStateSize>().setConstant(kOpen * kOpen);
  SetCovariance(cov, &prior);
  return prior;
}

// The smoother between two windows: where the window begins and what came before.
class Lag {
 public:
  Lag(const FlightData& flight, const VgdOptions& vgd, const SmootherOptions& options)
      : flight_(flight), vgd_(vgd), options_(options), start_(PriorMeans(vgd)) {}

  WindowEstimate Advance(int tau, double tilt) {
    vgd_.process.tilt = tilt;
    const WindowData data = CutWindow(flight_, vgd_, first_, tau, true);
    WindowProblem problem(flight_.track, data, vgd_, past_);
    problem.SetStart(start_, RoughPath(flight_.log.fixes, data.passes));
    const ceres::Solver::Summary summary = problem.Solve();
    WindowEstimate estimate = DescribeWindow(flight_, vgd_, data, tau, summary, &problem);
    if (estimate.converged) start_ = ThetaOf(estimate);
    if (!flight_.HasArc(tau)) {
      Break(tau, &problem);
    } else if (tau - first_ >= vgd_.gamma) {
      DropFirstPass(&problem);
    }
    return estimate;
  }

 private:
  void DropFirstPass(WindowProblem* problem) {
    const TimeNs from = flight_.passes[first_].begin, to = flight_.passes[first_ + 1].begin;
    // The first pass of the window's own data ends where the next begins, if that is in it.
    if (first_ + 1 >= static_cast<int>(flight_.passes.size()) || !HasKnot(*problem, to)) return;
    past_ = problem->Marginalise(to);
    Loosen(options_, problem->scaling(), SecondsBetween(from, to), &*past_);
    ++first_;
  }

  static bool HasKnot(const WindowProblem& problem, TimeNs t) {
    return problem.segments().back()->start() >= t;
  }

  // Marginalises up to the last knot and carries the parameters over the break.
  void Break(int tau, WindowProblem* problem) {
    first_ = tau;
    if (tau >= static_cast<int>(flight_.passes.size()) || problem->segments().size() < 2) return;
    const Prior last = problem->Marginalise(problem->segments().back()->start());
    const Pass& next = flight_.passes[tau];
    past_ =
        KeepParameters(last, vgd_, FitLine(flight_.log.fixes, next.first, next.last, next.begin));
    Loosen(options_, problem->scaling(), SecondsBetween(flight_.passes[tau - 1].end, next.begin),
           &*past_);
  }

  const FlightData& flight_;
  VgdOptions vgd_;
  SmootherOptions options_;
  Theta start_;
  int first_ = 0;  // index of the window's first pass
  std::optional<Prior> past_;
};

}  // namespace

SmootherOptions ReadSmootherOptions(const YamlMap& map) {
  SmootherOptions options;
  ReadNotNegative(map, "accel_bias_walk_mps2_per_sqrt_s", &options.accel_bias_walk);
  ReadNotNegative(map, "ahrs_error_walk_deg_per_sqrt_s", &options.ahrs_error_walk, kDegree);
  map.Finish();
  return options;
}

YAML::Node ToYaml(const SmootherOptions& options) {
  YAML::Node node;
  node["accel_bias_walk_mps2_per_sqrt_s"] = options.accel_bias_walk;
  node["ahrs_error_walk_deg_per_sqrt_s"] = options.ahrs_error_walk / kDegree;
  return node;
}

EstimatorRun RunSmoother(const FlightData& flight, const VgdOptions& vgd,
                         const SmootherOptions& options) {
  if (!vgd.process.Any()) {
    throw InputError(
        "the smoother needs process noise: set a strength under 'process' in the configuration");
  }
  EstimatorRun run{"smoother", vgd.gamma, {}, flight.warnings};
  DriftStrength drift(vgd);
  Lag lag(flight, vgd, options);
  for (int tau = 1; tau <= static_cast<int>(flight.passes.size()); ++tau) {
    double tilt = vgd.process.tilt;
    if (vgd.adapt_drift && tilt > 0.0) {
      drift.Learn(flight, tau, PriorMeans(vgd));
      tilt = drift.Tilt();
    }
    run.windows.push_back(lag.Advance(tau, tilt));
    const bool last = tau == static_cast<int>(flight.passes.size());
    if (!last && !run.windows.back().arc) run.warnings.push_back(flight.NoArcReason(tau));
  }
  return run;
}

}  // namespace trueline
