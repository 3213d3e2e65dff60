#include "problems/ekf/ekf_run.h"

#include <Eigen/Dense>
#include <chrono>
#include <cmath>

#include "problems/result/identifiability.h"
#include "problems/vgd/drive_track.h"
#include "problems/vgd/rough_path.h"

namespace trueline {

void PredictOver(const ImuInputs& imu, TimeNs t0, TimeNs t1, Ekf* filter) {
  if (t1 <= t0) return;
  imu.ForEachStep(t0, t1, [&](const ImuInput& input, double dt) { filter->Predict(input, dt); });
}

bool IteratedArcUpdate(const ImuInputs& imu, AttitudeForm form, TimeNs t0, const Fix& fix,
                       Ekf* filter) {
  constexpr int kMaxRounds = 4;
  constexpr double kSettled = 1e-3;  // sigmas, convergence in every state
  const Ekf at_start = *filter;
  const Matrix15d& P0 = at_start.cov();
  Vector15d shift = Vector15d::Zero();
  for (int round = 0; round < kMaxRounds; ++round) {
    *filter = at_start;
    filter->SetState(Moved(form, at_start.state(), shift));
    filter->RecordTransitions();
    PredictOver(imu, t0, fix.t, filter);
    // The end of the unshifted state, by the new linearisation.
    const Matrix15d& F = filter->recorded_transitions();
    filter->SetState(Moved(form, filter->state(), -(F * shift)));
    const Eigen::Matrix3d S = filter->InnovationCovariance(fix.sigma);
    const Eigen::Vector3d weighted = S.llt().solve(filter->Innovation(fix.p_E));
    const Vector15d next = P0 * F.topRows<3>().transpose() * weighted;
    const Vector15d change =
        (next - shift).cwiseAbs().cwiseQuotient(P0.diagonal().cwiseSqrt().cwiseMax(1e-12));
    if (change.maxCoeff() < kSettled) break;
    shift = next;
  }
  filter->StopRecording();
  return filter->Update(fix.p_E, fix.sigma);
}

namespace {

using Clock = std::chrono::steady_clock;

const std::vector<std::string> kNames(std::begin(kImuBiasNames), std::end(kImuBiasNames));
const std::vector<std::string> kUnits(std::begin(kImuBiasUnits), std::end(kImuBiasUnits));

TrajectoryPoint PointOf(TimeNs t, const NavState& x) { return {t, x.motion.p, x.motion.v}; }

EkfOptions WithScatter(EkfOptions options, const ImuInputs& imu) {
  if (options.gyro_from_log) options.noise.gyro_scatter = GyroScatter(imu);
  return options;
}

// The filter's run over one flight.
class Runner {
 public:
  Runner(const FlightData& flight, const EkfOptions& options)
      : flight_(flight),
        imu_(flight.log, flight.track),
        options_(WithScatter(options, imu_)),
        filter_(options_, flight.log.gravity) {
    const NavState x = StartOfPass(flight, imu_, flight.passes.front());
    filter_.Start(x, filter_.StartCovariance(x));
    start_sigma_ = filter_.cov().diagonal().tail<6>().cwiseSqrt();
    now_ = flight.passes.front().begin;
  }

  // Updates with the fixes since the last step up to the end of pass `tau` (from 1) and predicts
  // the arc that follows.
  WindowEstimate Step(int tau) {
    const auto clock = Clock::now();
    const Pass& pass = flight_.passes[tau - 1];
    WindowEstimate estimate;
    estimate.tau = tau;
    estimate.gamma = tau - first_tau_ + 1;
    estimate.begin = flight_.passes[first_tau_ - 1].begin;
    estimate.end = pass.end;
    estimate.iterations = 1;
    for (std::size_t i = StartAfterArc(tau); i <= pass.last; ++i) {
      TakeFix(flight_.log.fixes[i], &estimate);
    }
    StoreBiases(&estimate);
    if (flight_.HasArc(tau)) PredictArc(tau, &estimate);
    estimate.converged = filter_.state().motion.p.allFinite() && filter_.cov().allFinite();
    estimate.solve_time = std::chrono::duration<double>(Clock::now() - clock).count();
    return estimate;
  }

  // Restarts at pass `tau`, keeping the estimates of the biases.
  void Restart(int tau) {
    const NavState before = filter_.state();
    Matrix15d P = Matrix15d::Zero();
    const TimeNs begin = flight_.passes[tau - 1].begin;
    NavState x = StartOfPass(flight_, imu_, flight_.passes[tau - 1]);
    x.bias = before.bias;
    P = filter_.StartCovariance(x);
    P.bottomRightCorner<6, 6>() = filter_.cov().bottomRightCorner<6, 6>();
    if (options_.tuning == EkfTuning::kConsistent) AddBiasWalk(SecondsBetween(now_, begin), &P);
    filter_.Start(x, P);
    now_ = begin;
    first_tau_ = tau;
  }

 private:
  void AddBiasWalk(double seconds, Matrix15d* P) const {
    const ImuNoise& noise = options_.noise;
    P->diagonal().segment<3>(9).array() += noise.accel_walk * noise.accel_walk * seconds;
    P->diagonal().segment<3>(12).array() += noise.gyro_walk * noise.gyro_walk * seconds;
  }

  // Index of the first fix since the last step. The arc's prediction used no fix of the arc itself;
  // now that it is judged the filter returns to the arc's start and takes them, as the windows of
  // other estimators do.
  std::size_t StartAfterArc(int tau) {
    const std::size_t first = flight_.passes[tau - 1].first;
    if (!arc_start_) return first;
    const std::size_t withheld = flight_.passes[tau - 2].last + 1;
    if (withheld < first) {
      filter_ = *arc_start_;
      now_ = arc_start_time_;
    }
    return withheld;
  }

  void TakeFix(const Fix& fix, WindowEstimate* estimate) {
    // Without fixes of the arc the filter is already at its end; otherwise propagate to the fix.
    const bool after_arc = options_.iterated && arc_start_ && fix.t > arc_start_time_;
    bool taken = false;
    if (after_arc) {
      filter_ = *arc_start_;
      taken = IteratedArcUpdate(imu_, options_.attitude, arc_start_time_, fix, &filter_);
    } else {
      PredictOver(imu_, now_, fix.t, &filter_);
      taken = filter_.Update(fix.p_E, fix.sigma);
    }
    arc_start_.reset();
    now_ = fix.t;
    const NavState& x = filter_.state();
    const double weight = taken ? 1.0 : 0.0;
    estimate->misfits.push_back({fix.t, fix.gate, x.motion.p - fix.p_E, fix.sigma, weight});
    estimate->fitted.push_back(PointOf(fix.t, x));
  }

  void PredictArc(int tau, WindowEstimate* estimate) {
    constexpr TimeNs kSpacing = kNsPerSecond / 30;  // of the points that are kept
    ArcPrediction arc = flight_.ArcAfter(tau);
    arc_start_ = filter_;
    arc_start_time_ = now_;
    while (now_ < arc.end) {
      const TimeNs next = std::min(now_ + kSpacing, arc.end);
      PredictOver(imu_, now_, next, &filter_);
      now_ = next;
      estimate->predicted.push_back(PointOf(now_, filter_.state()));
    }
    arc.p_E = filter_.state().motion.p.head<2>();
    arc.cov = filter_.cov().topLeftCorner<2, 2>();
    estimate->arc = arc;
  }

  void StoreBiases(WindowEstimate* estimate) const {
    Vector15d x;
    x << Eigen::Matrix<double, 9, 1>::Zero(), filter_.state().bias.accel, filter_.state().bias.gyro;
    const Eigen::Matrix<double, 6, 6> P = filter_.cov().bottomRightCorner<6, 6>();
    const auto scale = start_sigma_.cwiseInverse().asDiagonal();
    const Identifiability shown =
        AnalyseIdentifiability(kNames, kUnits, start_sigma_, scale * P * scale);
    estimate->unobservable = shown.combinations;
    for (int i = 0; i < 6; ++i) {
      estimate->parameters.push_back(
          {kNames[i], x[9 + i], std::sqrt(P(i, i)), kUnits[i], shown.status[i]});
    }
  }

  const FlightData& flight_;
  ImuInputs imu_;
  EkfOptions options_;
  Ekf filter_;
  Eigen::VectorXd start_sigma_;  // of the biases
  TimeNs now_ = 0;
  int first_tau_ = 1;
  std::optional<Ekf> arc_start_;  // the filter at the start of the arc that was last predicted
  TimeNs arc_start_time_ = 0;
};

}  // namespace

NavState StartOfPass(const FlightData& flight, const ImuInputs& imu, const Pass& pass) {
  const LineFit line = FitLine(flight.log.fixes, pass.first, pass.last, pass.begin);
  NavState x;
  x.motion.p = line.p;
  x.motion.v = line.v;
  x.motion.q_E_I = imu.AhrsAttitudeAt(pass.begin);
  return x;
}

EstimatorRun RunEkf(const FlightData& flight, const EkfOptions& options, int gamma) {
  EstimatorRun run{"ekf", gamma, {}, flight.warnings};
  Runner runner(flight, options);
  const int passes = static_cast<int>(flight.passes.size());
  for (int tau = 1; tau <= passes; ++tau) {
    run.windows.push_back(runner.Step(tau));
    if (tau == passes || flight.HasArc(tau)) continue;
    run.warnings.push_back(flight.NoArcReason(tau) + "; the filter starts anew after it");
    runner.Restart(tau + 1);
  }
  return run;
}

}  // namespace trueline
