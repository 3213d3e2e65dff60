#include "problems/ekf/ekf.h"

#include <ceres/jet.h>

#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "cost_functions/models/rotation.h"
#include "problems/common/units.h"
#include "problems/result/identifiability.h"
#include "problems/vgd/drive_track.h"
#include "problems/vgd/rough_path.h"

namespace trueline {
namespace {

constexpr int kSeeds = 9;  // attitude, b_a, b_g
using NavJet = ceres::Jet<double, kSeeds>;

Vector3<NavJet> Seeded(const Eigen::Vector3d& value, int first) {
  return {NavJet(value[0], first), NavJet(value[1], first + 1), NavJet(value[2], first + 2)};
}

Eigen::Vector3d ValueOf(const Vector3<NavJet>& x) { return {x[0].a, x[1].a, x[2].a}; }

void StoreRows(const Vector3<NavJet>& x, int first_row, Transition* transition) {
  for (int i = 0; i < 3; ++i) transition->tail.row(first_row + i) = x[i].v.transpose();
}

template <class State>
void StoreMotion(const State& x, NavState* next, Transition* transition) {
  next->motion.p = ValueOf(x.p);
  next->motion.v = ValueOf(x.v);
  StoreRows(x.p, 0, transition);
  StoreRows(x.v, 3, transition);
}

ImuBias<NavJet> SeededBias(const NavState& x) {
  return {Seeded(x.bias.accel, 3), Seeded(x.bias.gyro, 6)};
}

NavState AdvanceErrorState(const NavState& x, const ImuInput& imu, double gravity, double dt,
                           Transition* transition) {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  KinematicState<NavJet> motion;
  motion.p = x.motion.p.cast<NavJet>();
  motion.v = x.motion.v.cast<NavJet>();
  motion.q_E_I =
      x.motion.q_E_I.cast<NavJet>() * RotationFromHalfVector<NavJet>(Seeded(zero, 0) * NavJet(0.5));
  KinematicStep(imu, SeededBias(x), gravity, dt, &motion);

  NavState next = x;
  StoreMotion(motion, &next, transition);
  const Eigen::Quaternion<NavJet>& q = motion.q_E_I;
  next.motion.q_E_I = Eigen::Quaterniond(q.w().a, q.x().a, q.y().a, q.z().a).normalized();
  // Twice the vector part of the small rotation between the new nominal attitude and q.
  const Eigen::Quaternion<NavJet> error = next.motion.q_E_I.conjugate().cast<NavJet>() * q;
  StoreRows(error.vec() * NavJet(2.0), 6, transition);
  return next;
}

NavState AdvanceEuler(const NavState& x, const ImuInput& imu, double gravity, double dt,
                      Transition* transition) {
  EulerKinematicState<NavJet> motion;
  motion.p = x.motion.p.cast<NavJet>();
  motion.v = x.motion.v.cast<NavJet>();
  motion.Phi = Seeded(EulerFromQuaternion(x.motion.q_E_I), 0);
  KinematicStep(imu, SeededBias(x), gravity, dt, &motion);

  NavState next = x;
  StoreMotion(motion, &next, transition);
  next.motion.q_E_I = QuaternionFromEuler(ValueOf(motion.Phi));
  StoreRows(motion.Phi, 6, transition);
  return next;
}

}  // namespace

Matrix15d Transition::Dense() const {
  Matrix15d F = Matrix15d::Identity();
  F.block<3, 3>(0, 3) = Eigen::Matrix3d::Identity() * dt;
  F.block<9, 9>(0, 6) = tail;
  return F;
}

NavState Advance(AttitudeForm form, const NavState& x, const ImuInput& imu, double gravity,
                 double dt, Transition* transition) {
  transition->dt = dt;
  return form == AttitudeForm::kEuler ? AdvanceEuler(x, imu, gravity, dt, transition)
                                      : AdvanceErrorState(x, imu, gravity, dt, transition);
}

NavState Moved(AttitudeForm form, const NavState& x, const Vector15d& error) {
  NavState moved = x;
  moved.motion.p += error.segment<3>(0);
  moved.motion.v += error.segment<3>(3);
  moved.bias.accel += error.segment<3>(9);
  moved.bias.gyro += error.segment<3>(12);
  const Eigen::Vector3d turn = error.segment<3>(6);
  if (form == AttitudeForm::kEuler) {
    moved.motion.q_E_I = QuaternionFromEuler<double>(EulerFromQuaternion(x.motion.q_E_I) + turn);
  } else {
    moved.motion.q_E_I = (x.motion.q_E_I * RotationByVector(turn)).normalized();
  }
  return moved;
}

Eigen::Matrix3d AttitudeErrorFromEarth(AttitudeForm form, const NavState& x) {
  Eigen::Matrix3d R_I_E = x.motion.q_E_I.conjugate().toRotationMatrix();
  if (form == AttitudeForm::kErrorState) return R_I_E;
  return EulerRateFromBodyRate<double>(EulerFromQuaternion(x.motion.q_E_I)) * R_I_E;
}

namespace {

constexpr int kV = 3, kAttitude = 6, kBa = 9, kBg = 12;

}  // namespace

Matrix15d Propagate(const Transition& F, const Matrix15d& P) {
  const auto to_p = F.tail.topRows<3>(), to_v = F.tail.middleRows<3>(3);
  const auto turn = F.tail.block<3, 3>(6, 0), turn_bg = F.tail.block<3, 3>(6, 6);
  // The upper nine rows of F P: biases stay, so the lower six rows are those of P.
  const Eigen::Matrix<double, 9, kNavSize> P_tail = P.bottomRows<9>();
  Eigen::Matrix<double, 9, kNavSize> M;
  M.topRows<3>().noalias() = P.topRows<3>() + F.dt * P.middleRows<3>(kV);
  M.topRows<3>().noalias() += to_p.lazyProduct(P_tail);
  M.middleRows<3>(3).noalias() = P.middleRows<3>(kV) + to_v.lazyProduct(P_tail);
  M.bottomRows<3>().noalias() = turn.lazyProduct(P_tail.topRows<3>());
  M.bottomRows<3>().noalias() += turn_bg.lazyProduct(P_tail.bottomRows<3>());

  Matrix15d next;
  const Eigen::Matrix<double, 9, 9> M_tail = M.rightCols<9>();
  next.block<9, 3>(0, 0).noalias() = M.leftCols<3>() + F.dt * M.middleCols<3>(kV);
  next.block<9, 3>(0, 0).noalias() += M_tail.lazyProduct(to_p.transpose());
  next.block<9, 3>(0, kV).noalias() = M.middleCols<3>(kV) + M_tail.lazyProduct(to_v.transpose());
  next.block<9, 3>(0, kAttitude).noalias() = M_tail.leftCols<3>().lazyProduct(turn.transpose());
  next.block<9, 3>(0, kAttitude).noalias() +=
      M_tail.rightCols<3>().lazyProduct(turn_bg.transpose());
  next.block<9, 6>(0, kBa) = M.rightCols<6>();
  next.block<6, 9>(kBa, 0) = M.rightCols<6>().transpose();
  next.bottomRightCorner<6, 6>() = P.bottomRightCorner<6, 6>();
  return next;
}

// N, M and R are the derivatives of dPhi/dt by b_g and of dv/dt by Phi and b_a; the transition
// holds them times dt. The gyroscope's noise enters like its bias, through N.
Matrix15d StepNoise(const Transition& F, const ImuNoise& noise) {
  const double t = F.dt;
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d M = F.tail.block<3, 3>(3, 0) / t;
  const Eigen::Matrix3d R = F.tail.block<3, 3>(3, 3) / t;
  const Eigen::Matrix3d N = F.tail.block<3, 3>(6, 6) / t;
  const double s_a = noise.accel * noise.accel;
  const Eigen::Vector3d s_g = noise.GyroSpectrum();
  const double s_ba = noise.accel_walk * noise.accel_walk;
  const double s_bg = noise.gyro_walk * noise.gyro_walk;
  const double t2 = t * t / 2.0, t3 = t * t * t / 6.0;
  const Eigen::Matrix3d turn = N * s_g.asDiagonal() * N.transpose();

  Matrix15d Q = Matrix15d::Zero();
  Q.block<3, 3>(0, 0) = I * (s_a * 2.0 * t3);
  Q.block<3, 3>(0, kV) = I * (s_a * t2);
  Q.block<3, 3>(0, kAttitude) = M * turn * t3;
  Q.block<3, 3>(0, kBa) = R * (s_ba * t3);
  Q.block<3, 3>(kV, kV) = I * (s_a * t + s_ba * 2.0 * t3) + M * turn * M.transpose() * (2.0 * t3);
  Q.block<3, 3>(kV, kAttitude) = M * turn * t2;
  Q.block<3, 3>(kV, kBa) = R * (s_ba * t2);
  Q.block<3, 3>(kV, kBg) = M * N * (s_bg * t3);
  Q.block<3, 3>(kAttitude, kAttitude) = turn * t + N * N.transpose() * (s_bg * 2.0 * t3);
  Q.block<3, 3>(kAttitude, kBg) = N * (s_bg * t2);
  Q.block<3, 3>(kBa, kBa) = I * (s_ba * t);
  Q.block<3, 3>(kBg, kBg) = I * (s_bg * t);
  Q.triangularView<Eigen::StrictlyLower>() = Q.transpose();
  return Q;
}

Matrix15d PaperStepNoise(const EkfOptions& options, double dt) {
  Matrix15d Q = Matrix15d::Zero();
  for (int i = 0; i < 9; ++i) Q(i, i) = options.paper_q[i] * options.paper_rate * dt;
  return Q;
}

Ekf::Ekf(const EkfOptions& options, double gravity) : options_(options), gravity_(gravity) {}

void Ekf::Start(const NavState& x, const Matrix15d& cov) {
  x_ = x;
  P_ = cov;
  refusals_ = 0;
}

Matrix15d Ekf::StartCovariance(const NavState& x) const {
  if (options_.tuning == EkfTuning::kPaper) {
    Vector15d P0;
    for (int i = 0; i < kNavSize; ++i) P0[i] = options_.paper_p0[i / 3];
    return P0.asDiagonal();
  }
  const EkfStart& s = options_.start;
  Matrix15d P = Matrix15d::Zero();
  const auto set = [&](int first, double sigma) {
    P.block<3, 3>(first, first) = Eigen::Matrix3d::Identity() * (sigma * sigma);
  };
  set(0, s.position);
  set(3, s.velocity);
  set(9, s.accel_bias);
  set(12, s.gyro_bias);
  const Eigen::Matrix3d J = AttitudeErrorFromEarth(options_.attitude, x);
  const Eigen::Vector3d sigma(s.tilt, s.tilt, s.heading);
  P.block<3, 3>(6, 6) = J * sigma.cwiseAbs2().asDiagonal() * J.transpose();
  return P;
}

void Ekf::Predict(const ImuInput& imu, double dt) {
  Transition F;
  x_ = Advance(options_.attitude, x_, imu, gravity_, dt, &F);
  P_ = Propagate(F, P_);
  P_ += options_.tuning == EkfTuning::kPaper ? PaperStepNoise(options_, dt)
                                             : StepNoise(F, options_.noise);
  if (recording_) recorded_ = F.Dense() * recorded_;
}

void Ekf::RecordTransitions() {
  recording_ = true;
  recorded_.setIdentity();
}

Eigen::Matrix3d Ekf::InnovationCovariance(double sigma) const {
  const double used = options_.tuning == EkfTuning::kPaper ? options_.paper_fix_sigma : sigma;
  return P_.topLeftCorner<3, 3>() + Eigen::Matrix3d::Identity() * (used * used);
}

bool Ekf::Refuses(double nis) {
  const bool refused = options_.gating == EkfGating::kChiSquare && nis > options_.gate &&
                       refusals_ < options_.max_refusals;
  refusals_ = refused ? refusals_ + 1 : 0;
  return refused;
}

bool Ekf::Update(const Eigen::Vector3d& fix_E, double sigma) {
  const Eigen::Vector3d innovation = Innovation(fix_E);
  const Eigen::Matrix3d S = InnovationCovariance(sigma);
  last_nis_ = innovation.dot(S.llt().solve(innovation));
  if (Refuses(last_nis_)) return false;
  Correct(innovation, S, sigma);
  return true;
}

void Ekf::Correct(const Eigen::Vector3d& innovation, const Eigen::Matrix3d& S, double sigma) {
  const double used = options_.tuning == EkfTuning::kPaper ? options_.paper_fix_sigma : sigma;
  const Eigen::Matrix<double, 15, 3> PHt = P_.leftCols<3>();
  const Eigen::Matrix<double, 15, 3> K = S.llt().solve(PHt.transpose()).transpose();
  const Vector15d error = K * innovation;
  x_ = Moved(options_.attitude, x_, error);

  // Joseph form (eq. 27); I - K H differs from the identity in its first three columns only.
  Matrix15d I_KH = Matrix15d::Identity();
  I_KH.leftCols<3>() -= K;
  P_ = (I_KH * P_ * I_KH.transpose() + used * used * K * K.transpose()).eval();
  if (options_.attitude == AttitudeForm::kErrorState) {
    // From here on attitude errors refer to the updated frame I.
    const Eigen::Vector3d half_turn = 0.5 * error.segment<3>(6);
    const Eigen::Matrix3d G = Eigen::Matrix3d::Identity() - Skew<double>(half_turn);
    P_.middleRows<3>(6) = (G * P_.middleRows<3>(6)).eval();
    P_.middleCols<3>(6) = (P_.middleCols<3>(6) * G.transpose()).eval();
  }
  P_ = (0.5 * (P_ + P_.transpose())).eval();
}

namespace {

void SerializeStart(YamlArchive* a, EkfStart* start) {
  a->Positive("position_sigma_m", &start->position);
  a->Positive("velocity_sigma_mps", &start->velocity);
  a->Positive("tilt_sigma_deg", &start->tilt, kDegree);
  a->Positive("heading_sigma_deg", &start->heading, kDegree);
  a->Positive("accel_bias_sigma_mps2", &start->accel_bias);
  a->Positive("gyro_bias_sigma_deg_per_s", &start->gyro_bias, kDegree);
}

// `above`: what every variance must exceed.
template <std::size_t kSize>
void SerializeVariances(YamlArchive* a, const std::string& key, double above,
                        const std::string& remedy, std::array<double, kSize>* variances) {
  std::vector<double> read(variances->begin(), variances->end());
  a->Value(key, &read);
  const bool valid =
      read.size() == kSize &&
      std::all_of(read.begin(), read.end(), [=](double value) { return value > above; });
  a->Require(valid, key, remedy);
  if (valid) std::copy(read.begin(), read.end(), variances->begin());
}

void SerializePaper(YamlArchive* a, EkfOptions* o) {
  SerializeVariances(a, "q_per_sample", -1e-300,
                     "needs nine variances of zero or above: three each for p (m^2), v (m^2/s^2), "
                     "Phi (rad^2)",
                     &o->paper_q);
  SerializeVariances(a, "p0", 0.0,
                     "needs five variances above zero: of p (m^2), v (m^2/s^2), Phi (rad^2), "
                     "b_a (m^2/s^4), b_g (rad^2/s^2)",
                     &o->paper_p0);
  a->Positive("fix_sigma_m", &o->paper_fix_sigma);
  a->Positive("sample_rate_hz", &o->paper_rate);
}

}  // namespace

void Serialize(YamlArchive* a, EkfOptions* o) {
  a->Choice("tuning", &o->tuning,
            {{"consistent", EkfTuning::kConsistent}, {"paper", EkfTuning::kPaper}});
  a->Choice("attitude", &o->attitude,
            {{"error_state", AttitudeForm::kErrorState}, {"euler", AttitudeForm::kEuler}});
  a->Choice("gating", &o->gating,
            {{"chi_square", EkfGating::kChiSquare}, {"none", EkfGating::kNone}});
  a->Positive("gate_chi_square", &o->gate);
  a->Value("max_refusals", &o->max_refusals);
  a->Value("iterated", &o->iterated);
  a->Map("start", [o](YamlArchive* map) { SerializeStart(map, &o->start); });
  a->Map("paper", [o](YamlArchive* map) { SerializePaper(map, o); });
}

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
