#include "problems/rotor/rotor_ekf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "problems/common/error.h"
#include "problems/result/statistics.h"
#include "problems/rotor/rotor_data.h"
#include "problems/rotor/rotor_slopes.h"
#include "problems/rotor/rotor_step.h"

namespace trueline {
namespace {

using Model = RotorAeroModel;
constexpr int kNoise = 6;
constexpr double kStartSeconds = 2.0;  // s, the start of the flight, filtered several times
// Sigmas of the moving state before the first pose: rad, m, m/s, rad/s.
constexpr double kSigmaAttitude = 0.2, kSigmaPosition = 1.0, kSigmaVelocity = 1.0, kSigmaRate = 1.0;
constexpr double kSettling = 1.0;    // s, before innovations are judged
constexpr double kFarBehind = 30.0;  // of log likelihood
constexpr double kSettled = 0.1;     // sigmas, by which a pass may still move its constants
using Disturbance = Eigen::Matrix<double, kNoise, 1>;

// The errors that the filter estimates: those of the node (moving state and drift) and of the
// unknown constants. Known constants have no rows and columns in the covariance.
class Unknowns {
 public:
  static constexpr int kMoving = RotorAeroModel::kMovingErrors;
  static constexpr int kMost = kNodeErrors + RotorAeroModel::kConstants;
  using Covariance = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMost, kMost>;
  // Columns of the unknowns.
  template <int kRows>
  using Rows = Eigen::Matrix<double, kRows, Eigen::Dynamic, 0, kRows, kMost>;

  explicit Unknowns(std::vector<int> free) : free_(std::move(free)) {}

  int size() const { return kNodeErrors + num_constants(); }
  int num_constants() const { return static_cast<int>(free_.size()); }
  // Index of the k-th unknown constant among all constants.
  int constant(int k) const { return free_[static_cast<std::size_t>(k)]; }

  // Columns by all errors of the state (RotorState), as columns by the unknowns; zero by the drift.
  template <class Derived>
  Rows<Derived::RowsAtCompileTime> Of(const Eigen::MatrixBase<Derived>& whole) const {
    Rows<Derived::RowsAtCompileTime> rows(whole.rows(), size());
    rows.template leftCols<kMoving>() = whole.template leftCols<kMoving>();
    rows.template middleCols<3>(kDriftError).setZero();
    for (int k = 0; k < num_constants(); ++k) {
      rows.col(kNodeErrors + k) = whole.col(kMoving + constant(k));
    }
    return rows;
  }
  // All errors of the state, without the drift; zero for known constants.
  template <class Derived>
  RotorError Whole(const Eigen::MatrixBase<Derived>& error) const {
    RotorError whole = RotorError::Zero();
    whole.template head<kMoving>() = error.template head<kMoving>();
    for (int k = 0; k < num_constants(); ++k) {
      whole[kMoving + constant(k)] = error[kNodeErrors + k];
    }
    return whole;
  }
  RotorErrorMatrix WholeCovariance(const Covariance& cov) const {
    RotorErrorMatrix whole = RotorErrorMatrix::Zero();
    for (int i = 0; i < kMoving; ++i) whole.col(i) = Whole(cov.col(i));
    for (int k = 0; k < num_constants(); ++k) {
      whole.col(kMoving + constant(k)) = Whole(cov.col(kNodeErrors + k));
    }
    return whole;
  }

 private:
  std::vector<int> free_;
};

// Product of a matrix with few rows and a covariance.
template <int kRows>
Unknowns::Rows<kRows> Times(const Unknowns::Rows<kRows>& rows, const Unknowns::Covariance& cov) {
  Unknowns::Rows<kRows> product = Unknowns::Rows<kRows>::Zero(kRows, cov.cols());
  AddProduct(1.0, rows, cov, product);
  return product;
}

class Filter {
 public:
  static constexpr int kErrors = Model::kErrors;
  static constexpr int kMost = Unknowns::kMost;
  static constexpr int kMoving = Model::kMovingErrors;

  Filter(const Model& model, const RotorData& data, const RotorEkfOptions& options)
      : model_(model),
        data_(data),
        options_(options),
        unknowns_(options.prior.Free()),
        columns_(options.prior.Free()),
        point_(options.point.value_or(options.prior.mean)) {}

  RotorEkfRun Run() {
    const double begin = data_.poses.front().t;
    const int passes = unknowns_.num_constants() == 0 ? 0 : options_.passes;
    bool settled = false;
    for (int pass = 0; pass < passes && !settled; ++pass) {
      Start();
      FlyUntil(begin + kStartSeconds);
      settled = MovePoint();
    }
    if (!settled) {
      Start();
      if (passes > 0) FlyUntil(begin + kStartSeconds);
    }
    held_ = false;
    FlyUntil(data_.poses.back().t);
    run_.state = x_;
    run_.cov = unknowns_.WholeCovariance(cov_);
    run_.point = point_;
    return run_;
  }

 private:
  // Initialises at the first pose with the prior.
  void Start() {
    x_ = Joined(RoughNodes(data_, options_.prior.mean).front().motion, options_.prior.mean);
    drift_.setZero();
    Eigen::VectorXd sigma(unknowns_.size());
    sigma.head<kMoving>() << Eigen::Vector3d::Constant(kSigmaAttitude),
        Eigen::Vector3d::Constant(kSigmaPosition), Eigen::Vector3d::Constant(kSigmaVelocity),
        Eigen::Vector3d::Constant(kSigmaRate);
    sigma.segment<3>(kDriftError).setConstant(options_.noise.angular_drift);
    for (int k = 0; k < unknowns_.num_constants(); ++k) {
      sigma[kNodeErrors + k] = options_.prior.sigma[unknowns_.constant(k)];
    }
    cov_ = sigma.cwiseAbs2().asDiagonal();
    held_ = true;
    t_ = data_.poses.front().t;
    pose_ = imu_ = 0;
    while (imu_ < data_.imu.size() && data_.imu[imu_].t < t_) ++imu_;
    run_.history.clear();
    run_.likelihoods.clear();
    run_.forecasts.clear();
    next_forecast_ = options_.forecast.horizons.empty() ? std::numeric_limits<double>::infinity()
                                                        : t_ + options_.forecast.first;
    run_.log_likelihood = 0.0;
  }

  // Updates with all poses up to the time `end`.
  void FlyUntil(double end) {
    for (; pose_ < data_.poses.size() && data_.poses[pose_].t <= end; ++pose_) {
      Propagate(data_.poses[pose_].t);
      UpdateWithPose(data_.poses[pose_]);
      run_.history.push_back(Estimate(t_));
      run_.likelihoods.push_back(run_.log_likelihood);
      if (!held_ && t_ >= next_forecast_) Forecast();
      if (!held_ && Hopeless()) return;
    }
  }

  // Predicts from here without measurements, and returns to here.
  void Forecast() {
    next_forecast_ = t_ + options_.forecast.spacing;
    for (const double horizon : options_.forecast.horizons) {
      const RotorPose* pose = PoseNear(data_, t_ + horizon);
      if (pose == nullptr) continue;
      const RotorState x = x_;
      const Eigen::Vector3d drift = drift_;
      const Unknowns::Covariance cov = cov_;
      const double begin = t_;
      while (t_ < pose->t - 1e-9) {
        const double next = std::min(pose->t, t_ + kLongestStep);
        Step(t_, next - t_, nullptr);
        t_ = next;
      }
      const PoseReading reading = Read(*pose, 3);
      const double squared = reading.innovation.dot(reading.S.ldlt().solve(reading.innovation));
      run_.forecasts.push_back({begin, horizon, options_.noise.position * reading.innovation.norm(),
                                1.0 - ChiSquareTail(squared, 3.0)});
      x_ = x;
      drift_ = drift;
      cov_ = cov;
      t_ = begin;
    }
  }

  // True if the likelihood is far behind the rival run's at the same pose.
  bool Hopeless() {
    if (options_.rival == nullptr) return false;
    const std::size_t now = run_.likelihoods.size() - 1;
    if (!(run_.log_likelihood < (*options_.rival)[now] - kFarBehind)) return false;
    run_.log_likelihood = -std::numeric_limits<double>::infinity();
    return true;
  }

  // Moves the linearisation point to where a pass ended, by at most three prior sigmas, and mass
  // and inertia to no less than half of what they were: accelerations are proportional to their
  // inverses, so a step from too small a value overshoots. True if the point has converged.
  bool MovePoint() {
    constexpr int kPositive = RotorDrivenModel::kCentre - RotorDrivenModel::kMass;
    const RotorConstants from = point_;
    const RotorConstants reach = 3.0 * options_.prior.sigma;
    point_ = x_.tail<Model::kConstants>().cwiseMax(from - reach).cwiseMin(from + reach);
    point_.head<kPositive>() = point_.head<kPositive>().cwiseMax(0.5 * from.head<kPositive>());
    double move = 0.0;
    for (int k = 0; k < unknowns_.num_constants(); ++k) {
      const int i = unknowns_.constant(k);
      move = std::max(
          move, std::abs(point_[i] - from[i]) / std::sqrt(cov_(kNodeErrors + k, kNodeErrors + k)));
    }
    return move < kSettled;
  }

  // The linearisation point: the estimate, with constants at `point_` while they are held.
  RotorState Point() const {
    RotorState at = x_;
    if (held_) at.tail<Model::kConstants>() = point_;
    return at;
  }
  // The constants' estimate less the linearisation point.
  RotorConstants Offset(const RotorState& at) const {
    return x_.tail<Model::kConstants>() - at.tail<Model::kConstants>();
  }

  // Propagates through all IMU samples up to the time `end`.
  void Propagate(double end) {
    while (t_ < end - 1e-9) {
      const bool sample = imu_ < data_.imu.size() && data_.imu[imu_].t <= t_ + 1e-9;
      if (sample) ++imu_;
      double next = std::min(end, t_ + kLongestStep);
      if (imu_ < data_.imu.size()) next = std::min(next, data_.imu[imu_].t);
      Step(t_, next - t_, sample ? &data_.imu[imu_ - 1] : nullptr);
      t_ = next;
    }
  }

  // The disturbance of a step after the update with the reading at its start (if any): mean,
  // covariance with the state (6 x size), and its own covariance.
  struct Held {
    Disturbance mean;
    Unknowns::Rows<kNoise> with_state;
    Eigen::Matrix<double, kNoise, kNoise> cov;
  };

  // One step. The reading at its start (if any) also measures the disturbance held over the step.
  void Step(double t, double dt, const RotorImu* imu) {
    Held held{Disturbance::Zero(),
              {},
              DisturbanceCovariance(model_, data_, options_.noise, Point(), t, dt)};
    held.with_state.setZero(kNoise, unknowns_.size());
    if (imu != nullptr) UpdateWithImu(t, *imu, &held);
    Predict(t, dt, held);
  }

  void UpdateWithImu(double t, const RotorImu& imu, Held* held) {
    const RotorState at = Point();
    const RotorReading reading = ReadWithSlope(model_, at, data_.InputAt(t), drift_, columns_);
    Eigen::Matrix<double, 6, 1> innovation, sigma;
    sigma << Eigen::Vector3d::Constant(options_.noise.accel),
        Eigen::Vector3d::Constant(options_.noise.gyro);
    innovation << imu.accel, imu.gyro;
    innovation -= reading.y + reading.slope.middleCols<Model::kConstants>(kMoving) * Offset(at);
    const Eigen::Matrix<double, 6, kNoise> D = DisturbanceFeedthrough(at), DW = D * held->cov;
    Unknowns::Rows<6> H = unknowns_.Of(reading.slope);
    H.middleCols<3>(kDriftError) = D.rightCols<3>();
    Unknowns::Rows<6> HP = Times<6>(H, cov_);
    Eigen::Matrix<double, 6, 6> S = DW * D.transpose();
    S += HP.lazyProduct(H.transpose());
    S.diagonal() += sigma.cwiseAbs2();
    const Eigen::LLT<Eigen::Matrix<double, 6, 6>> llt(S);
    const Eigen::Matrix<double, 6, 1> weighed = llt.solve(innovation);
    Judge(t, innovation.dot(weighed), llt.matrixLLT().diagonal().prod());
    const Eigen::VectorXd step = HP.transpose() * weighed;
    held->mean = DW.transpose() * weighed;
    const Eigen::Matrix<double, 6, kNoise> B = llt.matrixL().solve(DW);
    llt.matrixL().solveInPlace(HP);
    held->with_state = -B.transpose().lazyProduct(HP);
    held->cov -= B.transpose() * B;
    const Eigen::Matrix<double, Eigen::Dynamic, 6, 0, kMost, 6> PH = HP.transpose();
    cov_ -= PH.lazyProduct(HP);
    Move(step);
  }

  void Move(const Eigen::VectorXd& step) {
    x_ = Plus(x_, unknowns_.Whole(step));
    drift_ += step.segment<3>(kDriftError);
  }

  void Predict(double t, double dt, const Held& held) {
    RotorState at = Point();
    const RotorConstants constants = x_.tail<Model::kConstants>(), away = Offset(at);
    const Eigen::Matrix<double, kMoving, kNoise> G = DisturbanceInput(at, dt);
    Disturbance disturbance = held.mean;
    disturbance.tail<3>() += drift_;
    const RotorStepSlope slope =
        StepWithSlope(model_, data_.InputAt(t + 0.5 * dt), disturbance, dt, &at, columns_);
    Unknowns::Rows<kMoving> F = unknowns_.Of(slope.by_error);
    F.middleCols<3>(kDriftError) = slope.by_turn();
    Unknowns::Rows<kMoving> FP = Times<kMoving>(F, cov_);
    FP += G.lazyProduct(held.with_state);
    Eigen::Matrix<double, kMoving, kNoise> with_held = G * held.cov;
    with_held += F.lazyProduct(held.with_state.transpose());
    Eigen::Matrix<double, kMoving, kMoving> moving = with_held * G.transpose();
    moving += FP.lazyProduct(F.transpose());
    cov_.topRows<kMoving>() = FP;
    cov_.leftCols<kMoving>() = FP.transpose();
    cov_.topLeftCorner<kMoving, kMoving>() = 0.5 * (moving + moving.transpose());
    LetDriftDecay(dt);
    const double wander = options_.wander * options_.wander * dt;
    for (int k = 0; wander > 0.0 && k < unknowns_.num_constants(); ++k) {
      const double sigma = options_.prior.sigma[unknowns_.constant(k)];
      cov_(kNodeErrors + k, kNodeErrors + k) += wander * sigma * sigma;
    }
    MoveTo(at, slope.by_error.rightCols<Model::kConstants>() * away, constants);
    if (!x_.allFinite()) {
      throw InputError(fmt::format(
          "the filter diverged after {:.2f} s; widen priors or noise, or check frames and rotors",
          t));
    }
  }

  void LetDriftDecay(double dt) {
    const double left = options_.noise.DriftLeft(dt);
    drift_ *= left;
    cov_.middleRows<3>(kDriftError) *= left;
    cov_.middleCols<3>(kDriftError) *= left;
    cov_.diagonal().segment<3>(kDriftError).array() += options_.noise.NewDrift(dt);
  }

  // Moves the state to the end of a step from Point(), plus the first-order effect of the
  // constants' offset.
  void MoveTo(const RotorState& end, const Eigen::Matrix<double, kMoving, 1>& offset,
              const RotorConstants& constants) {
    x_ = end;
    x_.head<4>().normalize();
    RotorError error = RotorError::Zero();
    error.head<kMoving>() = offset;
    x_ = Plus(x_, error);
    x_.tail<Model::kConstants>() = constants;
  }

  // A pose against the state; errors are in sigmas. Three rows are the position's alone.
  struct PoseReading {
    Eigen::VectorXd innovation;
    Eigen::MatrixXd HP, S;
  };
  PoseReading Read(const RotorPose& pose, int rows) const {
    std::array<RotorJet, Model::kStates> x;
    std::array<RotorJet, 6> error;
    const RotorState at = Point();
    SeedErrors(at, x.data());
    ErrorOf(pose, options_.noise)(x.data(), rows, error.data());
    Eigen::Matrix<double, Eigen::Dynamic, kErrors, 0, 6> whole(rows, kErrors);
    Eigen::VectorXd innovation(rows);
    for (int i = 0; i < rows; ++i) {
      whole.row(i) = error[i].v.transpose();
      innovation[i] = -error[i].a;
    }
    innovation -= whole.rightCols<Model::kConstants>() * Offset(at);
    const Unknowns::Rows<Eigen::Dynamic> H = unknowns_.Of(whole);
    const Eigen::MatrixXd HP = H * cov_;
    Eigen::MatrixXd S = HP * H.transpose();
    S.diagonal().array() += 1.0;
    return {innovation, HP, S};
  }

  void UpdateWithPose(const RotorPose& pose) {
    const auto [innovation, HP, S] = Read(pose, data_.attitude ? 6 : 3);
    const Eigen::LLT<Eigen::MatrixXd> llt(S);
    // Innovations are in sigmas; the density in SI needs the factor of that change of units.
    const double unit = std::pow(options_.noise.position, 3) *
                        (data_.attitude ? std::pow(options_.noise.attitude, 3) : 1.0);
    Judge(pose.t, innovation.dot(llt.solve(innovation)), unit * llt.matrixLLT().diagonal().prod());
    const Eigen::MatrixXd K = llt.solve(HP).transpose();
    cov_ -= K * HP;
    cov_ = (0.5 * (cov_ + cov_.transpose())).eval();
    Move(K * innovation);
  }

  // Adds one innovation's log density; `root_determinant` is that of the Cholesky factor of its
  // covariance.
  void Judge(double t, double squared, double root_determinant) {
    if (t < data_.poses.front().t + kSettling) return;
    run_.log_likelihood -= 0.5 * squared + std::log(root_determinant);
  }

  RotorEstimate Estimate(double t) const {
    RotorEstimate estimate;
    estimate.t = t;
    estimate.node = {x_.head<Model::kMoving>(), drift_};
    estimate.mean = x_.tail<Model::kConstants>();
    estimate.sigma =
        unknowns_.Whole(cov_.diagonal().cwiseMax(0.0).cwiseSqrt()).tail<Model::kConstants>();
    return estimate;
  }

  const Model& model_;
  const RotorData& data_;
  const RotorEkfOptions& options_;
  Unknowns unknowns_;
  SlopeColumns columns_;
  RotorState x_;
  Eigen::Vector3d drift_;  // rad/s^2
  Unknowns::Covariance cov_;
  RotorConstants point_;  // linearisation point of held constants
  bool held_ = true;
  double t_ = 0.0;                  // s
  std::size_t pose_ = 0, imu_ = 0;  // the next ones to process
  double next_forecast_ = 0.0;      // s
  RotorEkfRun run_;
};

}  // namespace

RotorEkfRun RunRotorEkf(const RotorAeroModel& model, const RotorData& data,
                        const RotorEkfOptions& options) {
  return Filter(model, data, options).Run();
}

RotorEkfRun RunOrDiverge(const RotorAeroModel& model, const RotorData& data,
                         const RotorEkfOptions& options) {
  RotorEkfRun run;
  try {
    run = RunRotorEkf(model, data, options);
  } catch (const InputError&) {
    run.log_likelihood = std::numeric_limits<double>::quiet_NaN();
  }
  if (!std::isfinite(run.log_likelihood)) {
    run.log_likelihood = -std::numeric_limits<double>::infinity();
  }
  return run;
}

}  // namespace trueline
