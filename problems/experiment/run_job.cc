#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/common/error.h"
#include "problems/experiment/accuracy.h"
#include "problems/experiment/job.h"
#include "problems/log/native_log.h"
#include "problems/result/statistics.h"
#include "problems/simulation/simulate.h"
#include "problems/trajectory/mocap_path.h"
#include "problems/vgd/vgd.h"
#include "problems/vgd/window_estimate.h"

namespace trueline {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

struct JobLog {
  FlightLog log;
  std::map<std::string, double> truth;  // parameters, of a simulated flight
  SimulationTruth flight_truth;         // of a simulated flight, without its trajectory
};

JobLog MakeLog(const Job& job) {
  if (const auto* config = std::get_if<SimulationConfig>(&job.flight)) {
    SimulationTruth truth;
    FlightLog log = Simulate(*config, job.seed, &truth);
    truth.trajectory = {};
    return {std::move(log), TrueParameters(truth), truth};
  }
  if (const auto* foreign = std::get_if<ForeignLog>(&job.flight)) {
    return {ConvertLog(foreign->map, foreign->files, foreign->options), {}, {}};
  }
  return {ReadNativeLog(std::get<std::filesystem::path>(job.flight)), {}, {}};
}

ArcRow RowOf(const WindowEstimate& window, const std::string& label, const EstimatorRun& run,
             bool mocap) {
  const ArcPrediction& arc = *window.arc;
  ArcRow row;
  row.label = label;
  row.estimator = run.estimator;
  row.gamma = run.gamma;
  row.tau = window.tau;
  row.begin = ToSeconds(arc.begin);
  row.end = ToSeconds(arc.end);
  row.error = arc.truth ? arc.FinalPointError() : kNoNumber;
  row.predicted_sigma = arc.PredictedSigma();
  row.inside_95 = arc.truth && arc.Inside95();
  row.truth = arc.truth_source;
  row.counted = arc.truth && (!mocap || arc.truth_source == "mocap");
  row.iterations = window.iterations;
  row.bound = kNoNumber;
  row.solve_time = window.solve_time;
  return row;
}

void AddArcs(const EstimatorRun& run, const std::string& label, JobResult* result) {
  const bool mocap = std::any_of(run.windows.begin(), run.windows.end(), [](const auto& window) {
    return window.arc && window.arc->truth_source == "mocap";
  });
  for (const WindowEstimate& window : run.windows) {
    if (window.arc) result->arcs.push_back(RowOf(window, label, run, mocap));
  }
}

constexpr double kPathInterval = 0.04;  // s: 25 Hz is enough for a plot

std::vector<TrajectoryPoint> MocapPath(const std::vector<PoseSample>& samples) {
  const std::vector<Eigen::Vector3d> v_E = PathVelocity(samples, kNsPerSecond / 20);
  std::vector<TrajectoryPoint> points;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    points.push_back({samples[i].t, samples[i].p_E, v_E[i]});
  }
  return points;
}

// Points at least kPathInterval apart, and the last one.
void AddPath(const std::vector<TrajectoryPoint>& samples, const std::string& label,
             const std::string& kind, int tau, std::vector<PathRow>* paths) {
  double last = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double t = ToSeconds(samples[i].t);
    if (t - last < kPathInterval && i + 1 < samples.size()) continue;
    last = t;
    const Eigen::Vector3d &p = samples[i].p_E, &v = samples[i].v_E;
    paths->push_back({label, kind, tau, t, p.x(), p.y(), p.z(), v.x(), v.y(), v.z()});
  }
}

void AddTruthPaths(const FlightLog& log, std::vector<PathRow>* paths) {
  AddPath(MocapPath(log.mocap), "truth", "mocap", 0, paths);
  for (const Fix& fix : log.fixes) {
    paths->push_back({"fixes", "fix", 0, ToSeconds(fix.t), fix.p_E.x(), fix.p_E.y(), fix.p_E.z(),
                      kNoNumber, kNoNumber, kNoNumber});
  }
}

void AddEstimates(const WindowEstimate& window, const std::string& label,
                  const std::map<std::string, double>& truth, std::vector<EstimateRow>* estimates) {
  for (const ParameterEstimate& p : window.parameters) {
    const auto known = truth.find(p.name);
    estimates->push_back({label, window.tau, ToSeconds(window.end), p.name, p.unit, p.value,
                          p.sigma, known != truth.end() ? known->second : kNoNumber});
  }
}

StartsRow StartsOf(const FlightData& flight, const VgdOptions& options, const std::string& label,
                   int tau, const Job& job) {
  const StartStudy study = StudyStarts(flight, options, tau, job.starts, job.seed);
  const std::vector<double> iterations(study.iterations.begin(), study.iterations.end());
  return {label,
          options.gamma,
          tau,
          study.starts,
          study.same_optimum,
          Mean(iterations),
          *std::max_element(study.iterations.begin(), study.iterations.end())};
}

void AddForecasts(const Job& job, const JobEstimator& estimator, const EstimatorRun& run,
                  Estimators* estimators, std::vector<ForecastRow>* rows) {
  VgdOptions vgd = estimator.options.vgd;
  vgd.gamma = run.gamma;
  for (const WindowEstimate& window : run.windows) {
    vgd.process = estimators->Processes()[window.tau - 1];
    for (const Forecast& f :
         ForecastAfter(estimators->flight(), vgd, window.tau, ThetaOf(window), job.forecast)) {
      rows->push_back(
          {estimator.label, run.gamma, window.tau, f.horizon, f.error, f.sigma, f.rank});
    }
  }
}

void RunGamma(const Job& job, const JobEstimator& estimator, int gamma, Estimators* estimators,
              const std::map<std::string, double>& truth, JobResult* result) {
  const FlightData& flight = estimators->flight();
  const EstimatorRun run = estimators->Run(estimator.name, gamma);
  AddArcs(run, estimator.label, result);
  const auto rows =
      Convergence(run, estimator.label, truth, job.convergence, flight.passes.front().begin);
  result->convergence.insert(result->convergence.end(), rows.begin(), rows.end());
  if (job.paths && gamma == estimator.gammas.front()) {
    for (const WindowEstimate& window : run.windows) {
      AddPath(window.fitted, estimator.label, "fit", window.tau, &result->paths);
      AddPath(window.predicted, estimator.label, "prediction", window.tau, &result->paths);
      AddEstimates(window, estimator.label, truth, &result->estimates);
    }
  }
  if (estimator.name != "vgd") return;
  AddForecasts(job, estimator, run, estimators, &result->forecasts);
  if (job.starts == 0) return;
  VgdOptions vgd = estimator.options.vgd;
  vgd.gamma = gamma;
  for (int tau = 1; tau <= static_cast<int>(flight.passes.size()); ++tau) {
    result->starts.push_back(StartsOf(flight, vgd, estimator.label, tau, job));
  }
}

void RequirePass(const FlightData& flight, const JobEstimator& estimator) {
  if (!flight.passes.empty()) return;
  throw InputError(estimator.label +
                   ": no pass to fit: the fixes come singly, with longer pauses than pass_gap_s "
                   "between them, or imu.csv or attitude.csv has a gap in every pass");
}

// Truth of eq. 16.
Theta TrueTheta(const std::map<std::string, double>& truth) {
  Theta theta;
  for (int i = 0; i < kMotionSize; ++i) theta[i] = truth.at(kTheta[i].name);
  return theta;
}

// Replaces the estimator's assumed noise by the simulated flight's: turbulence as white noise of
// equal density at low frequency, and the spread of the AHRS's error.
void UseTrueNoise(const SimulationTruth& truth, VgdOptions* vgd) {
  const simulation::TurbulenceConfig& air = truth.config.turbulence;
  vgd->process.gust = 0.0;
  vgd->process.acceleration = air.sigma.head<2>().maxCoeff() * std::sqrt(2.0 * air.memory);
  vgd->process.tilt = truth.ahrs_error_sigma.head<2>().norm() / std::sqrt(2.0);
  vgd->process.heading = truth.ahrs_error_sigma.z();
}

// Sets every arc's bound for its gamma and tau. The bound depends on the flight and its noise only,
// so all labels share it.
void AddBounds(const Job& job, const JobLog& flown, JobResult* result) {
  const auto source = std::find_if(job.estimators.begin(), job.estimators.end(),
                                   [&](const JobEstimator& e) { return e.label == job.bound; });
  VgdOptions vgd = source->options.vgd;
  UseTrueNoise(flown.flight_truth, &vgd);
  const FlightData flight(flown.log, vgd.drive, vgd.passes, vgd.drag_measurement);
  const Theta theta = TrueTheta(flown.truth);
  std::map<std::pair<int, int>, double> bounds;  // by gamma and tau
  for (ArcRow& row : result->arcs) {
    if (row.tau > static_cast<int>(flight.passes.size()) || !flight.HasArc(row.tau)) continue;
    const auto [place, is_new] = bounds.try_emplace({row.gamma, row.tau}, kNoNumber);
    if (is_new) {
      vgd.gamma = row.gamma;
      place->second = LeastFinalPointError(FinalPointBound(flight, vgd, row.tau, theta));
    }
    row.bound = place->second;
  }
}

}  // namespace

JobResult RunJob(const Job& job) {
  if (const auto* kind = std::get_if<std::shared_ptr<const RotorFlightKind>>(&job.flight)) {
    JobResult result;
    result.trials.push_back(FlyTrial(**kind, job.seed));
    return result;
  }
  const JobLog flown = MakeLog(job);
  JobResult result;
  if (job.paths) AddTruthPaths(flown.log, &result.paths);
  for (const JobEstimator& estimator : job.estimators) {
    const VgdOptions& vgd = estimator.options.vgd;
    const FlightData flight(flown.log, vgd.drive, vgd.passes, vgd.drag_measurement);
    RequirePass(flight, estimator);
    Estimators estimators(flight, estimator.options);
    for (const int gamma : estimator.gammas) {
      RunGamma(job, estimator, gamma, &estimators, flown.truth, &result);
    }
  }
  // Only for simulated flights: a bound needs the true noise.
  const bool simulated = std::holds_alternative<SimulationConfig>(job.flight);
  if (simulated && !job.bound.empty()) AddBounds(job, flown, &result);
  return result;
}

}  // namespace trueline
