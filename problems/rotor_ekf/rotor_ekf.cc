#include "problems/rotor_ekf/rotor_ekf.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "problems/common/error.h"
#include "problems/rotor_data/pose_prediction.h"
#include "problems/rotor_data/rotor_step.h"
#include "problems/rotor_data/rough_nodes.h"

namespace trueline {
namespace {

using Model = RotorAeroModel;
constexpr int kErrors = Model::kErrors;
constexpr int kMoving = Model::kMovingErrors;
constexpr int kNoise = 6;
constexpr double kLongestStep = 0.01;  // s; longer gaps in the IMU are stepped through
constexpr double kSettling = 1.0;      // s, before innovations are judged
constexpr double kSettled = 0.1;       // sigmas, by which a pass may still move its constants
using Disturbance = Eigen::Matrix<double, kNoise, 1>;

class Filter {
 public:
  Filter(const Model& model, const RotorData& data, const RotorEkfOptions& options)
      : model_(model),
        data_(data),
        options_(options),
        point_(options.point.value_or(options.prior.mean)) {}

  RotorEkfRun Run() {
    const double begin = data_.poses.front().t;
    const int passes = options_.prior.Free().empty() ? 0 : options_.passes;
    for (int pass = 0; pass < passes; ++pass) {
      Start();
      FlyUntil(begin + options_.start_seconds);
      if (MovePoint()) break;
    }
    Start();
    if (passes > 0) FlyUntil(begin + options_.start_seconds);
    held_ = false;
    FlyUntil(data_.poses.back().t);
    run_.state = x_;
    run_.cov = cov_;
    run_.point = point_;
    return run_;
  }

 private:
  // At the first pose, knowing the prior.
  void Start() {
    x_ = Joined(RoughNodes(data_, options_.prior.mean).front(), options_.prior.mean);
    RotorError sigma;
    sigma << Eigen::Vector3d::Constant(options_.sigma_attitude),
        Eigen::Vector3d::Constant(options_.sigma_position),
        Eigen::Vector3d::Constant(options_.sigma_velocity),
        Eigen::Vector3d::Constant(options_.sigma_rate), options_.prior.sigma;
    cov_ = sigma.cwiseAbs2().asDiagonal();
    held_ = true;
    t_ = data_.poses.front().t;
    pose_ = imu_ = 0;
    while (imu_ < data_.imu.size() && data_.imu[imu_].t < t_) ++imu_;
    run_.history.clear();
    run_.log_likelihood = 0.0;
  }

  // Takes all poses up to the time `end`.
  void FlyUntil(double end) {
    for (; pose_ < data_.poses.size() && data_.poses[pose_].t <= end; ++pose_) {
      Propagate(data_.poses[pose_].t);
      UpdateWithPose(data_.poses[pose_]);
      run_.history.push_back(Estimate(t_));
    }
  }

  // To where a pass ended, within three of the prior's sigmas of where it was, mass and inertia to
  // no less than half of what they were: accelerations go with their inverse, and a step from too
  // small a value overshoots. True where that is no move.
  bool MovePoint() {
    constexpr int kPositive = RotorDrivenModel::kCentre - RotorDrivenModel::kMass;
    const RotorConstants from = point_;
    const RotorConstants reach = 3.0 * options_.prior.sigma;
    point_ = x_.tail<Model::kConstants>().cwiseMax(from - reach).cwiseMin(from + reach);
    point_.head<kPositive>() = point_.head<kPositive>().cwiseMax(0.5 * from.head<kPositive>());
    double move = 0.0;
    for (const int i : options_.prior.Free()) {
      const int error = Model::kMovingErrors + i;
      move = std::max(move, std::abs(point_[i] - from[i]) / std::sqrt(cov_(error, error)));
    }
    return move < kSettled;
  }

  // Where the model is linearised: the estimate, its constants held or not.
  RotorState Point() const {
    RotorState at = x_;
    if (held_) at.tail<Model::kConstants>() = point_;
    return at;
  }
  // What the estimate is away from there.
  RotorConstants Offset(const RotorState& at) const {
    return x_.tail<Model::kConstants>() - at.tail<Model::kConstants>();
  }

  // Through all IMU samples up to the time `end`.
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

  // One step; the reading at its start (if any) also tells of the disturbance held over it.
  void Step(double t, double dt, const RotorImu* imu) {
    const RotorNoise& noise = options_.noise;
    Disturbance variance, w = Disturbance::Zero();
    variance << Eigen::Vector3d::Constant(std::pow(noise.force_density, 2) / dt),
        Eigen::Vector3d::Constant(std::pow(noise.angular_density, 2) / dt);
    Augmented cov = Augmented::Zero();
    cov.topLeftCorner<kErrors, kErrors>() = cov_;
    cov.bottomRightCorner<kNoise, kNoise>() = variance.asDiagonal();
    if (imu != nullptr) w = UpdateWithImu(t, *imu, &cov);
    Predict(t, dt, w, cov);
  }

  using Augmented = Eigen::Matrix<double, kErrors + kNoise, kErrors + kNoise>;
  using AugmentedRows = Eigen::Matrix<double, 6, kErrors + kNoise>;

  // Returns the disturbance's estimate.
  Disturbance UpdateWithImu(double t, const RotorImu& imu, Augmented* cov) {
    std::array<RotorJet, Model::kStates> x;
    std::array<RotorJet, 6> y;
    const RotorState at = Point();
    SeedErrors(at, x.data());
    model_.Imu(x.data(), data_.InputAt(t), y.data());
    Eigen::Matrix<double, 6, 1> innovation, sigma;
    sigma << Eigen::Vector3d::Constant(options_.noise.accel),
        Eigen::Vector3d::Constant(options_.noise.gyro);
    AugmentedRows H;
    H.rightCols<kNoise>() = DisturbanceFeedthrough(at);
    for (int i = 0; i < 6; ++i) {
      innovation[i] = (i < 3 ? imu.accel[i] : imu.gyro[i - 3]) - y[i].a;
      H.row(i).head<kErrors>() = y[i].v.transpose();
    }
    innovation -= H.middleCols<Model::kConstants>(kMoving) * Offset(at);
    const AugmentedRows HP = H * *cov;
    Eigen::Matrix<double, 6, 6> S = HP * H.transpose();
    S.diagonal() += sigma.cwiseAbs2();
    const Eigen::LLT<Eigen::Matrix<double, 6, 6>> llt(S);
    Judge(t, innovation.dot(llt.solve(innovation)), llt.matrixLLT().diagonal().prod());
    const Eigen::Matrix<double, kErrors + kNoise, 6> K = llt.solve(HP).transpose();
    const Eigen::Matrix<double, kErrors + kNoise, 1> step = K * innovation;
    *cov -= K * HP;
    x_ = Plus(x_, RotorError(step.head<kErrors>()));
    return step.tail<kNoise>();
  }

  void Predict(double t, double dt, const Disturbance& w, const Augmented& cov) {
    std::array<RotorJet, Model::kStates> x;
    std::array<RotorJet, kNoise> disturbance;
    for (int i = 0; i < kNoise; ++i) disturbance[i] = RotorJet(w[i]);
    const RotorState at = Point();
    const RotorConstants constants = x_.tail<Model::kConstants>();
    SeedErrors(at, x.data());
    RotorMidpointStep(model_, data_.InputAt(t + 0.5 * dt), disturbance.data(), dt, x.data());
    Eigen::Matrix<double, kMoving, kErrors + kNoise> F;
    F.leftCols<kErrors>() = MovingSensitivity(x.data());
    F.rightCols<kNoise>() = DisturbanceInput(at, dt);
    const Eigen::Matrix<double, kMoving, kErrors + kNoise> FP = F * cov;
    cov_ = cov.topLeftCorner<kErrors, kErrors>();
    cov_.topRows<kMoving>() = FP.leftCols<kErrors>();
    cov_.leftCols<kMoving>() = cov_.topRows<kMoving>().transpose().eval();
    cov_.topLeftCorner<kMoving, kMoving>() = FP * F.transpose();
    const double wander = options_.wander * options_.wander * dt;
    cov_.diagonal().tail<Model::kConstants>() += wander * options_.prior.sigma.cwiseAbs2();
    cov_ = (0.5 * (cov_ + cov_.transpose())).eval();
    MoveTo(x, F.middleCols<Model::kConstants>(kMoving) * Offset(at), constants);
    if (!x_.allFinite()) {
      throw InputError(fmt::format(
          "the filter diverged after {:.2f} s; widen priors or noise, or check frames and rotors",
          t));
    }
  }

  // To the end of a step from Point(), and on by what the offset of the constants makes of it.
  void MoveTo(const std::array<RotorJet, Model::kStates>& end,
              const Eigen::Matrix<double, kMoving, 1>& offset, const RotorConstants& constants) {
    for (int i = 0; i < Model::kMoving; ++i) x_[i] = end[i].a;
    x_.head<4>().normalize();
    RotorError error = RotorError::Zero();
    error.head<kMoving>() = offset;
    x_ = Plus(x_, error);
    x_.tail<Model::kConstants>() = constants;
  }

  void UpdateWithPose(const RotorPose& pose) {
    const int rows = data_.attitude ? 6 : 3;
    std::array<RotorJet, Model::kStates> x;
    std::array<RotorJet, 6> error;
    const RotorState at = Point();
    SeedErrors(at, x.data());
    PoseError(pose, data_.attitude, options_.noise, x.data(), error.data());
    Eigen::Matrix<double, Eigen::Dynamic, kErrors, 0, 6> H(rows, kErrors);
    Eigen::VectorXd innovation(rows);
    for (int i = 0; i < rows; ++i) {
      H.row(i) = error[i].v.transpose();
      innovation[i] = -error[i].a;
    }
    innovation -= H.rightCols<Model::kConstants>() * Offset(at);
    const Eigen::MatrixXd HP = H * cov_;
    Eigen::MatrixXd S = HP * H.transpose();
    S.diagonal().array() += 1.0;  // errors are in sigmas
    const Eigen::LLT<Eigen::MatrixXd> llt(S);
    // Innovations are in sigmas: their scale belongs to the density.
    const double unit = std::pow(options_.noise.position, 3) *
                        (data_.attitude ? std::pow(options_.noise.attitude, 3) : 1.0);
    Judge(pose.t, innovation.dot(llt.solve(innovation)), unit * llt.matrixLLT().diagonal().prod());
    const Eigen::MatrixXd K = llt.solve(HP).transpose();
    cov_ -= K * HP;
    cov_ = (0.5 * (cov_ + cov_.transpose())).eval();
    x_ = Plus(x_, RotorError(K * innovation));
  }

  // Adds one innovation's density; `root_determinant` is that of its covariance's Cholesky factor.
  void Judge(double t, double squared, double root_determinant) {
    if (t < data_.poses.front().t + kSettling) return;
    run_.log_likelihood -= 0.5 * squared + std::log(root_determinant);
  }

  RotorEstimate Estimate(double t) const {
    RotorEstimate estimate;
    estimate.t = t;
    estimate.moving = x_.head<Model::kMoving>();
    estimate.mean = x_.tail<Model::kConstants>();
    estimate.sigma = cov_.diagonal().tail<Model::kConstants>().cwiseMax(0.0).cwiseSqrt();
    return estimate;
  }

  const Model& model_;
  const RotorData& data_;
  const RotorEkfOptions& options_;
  RotorState x_;
  RotorErrorMatrix cov_;
  RotorConstants point_;  // where constants are held for linearisation
  bool held_ = true;
  double t_ = 0.0;                  // s
  std::size_t pose_ = 0, imu_ = 0;  // that come next
  RotorEkfRun run_;
};

}  // namespace

RotorEkfRun RunRotorEkf(const RotorAeroModel& model, const RotorData& data,
                        const RotorEkfOptions& options) {
  return Filter(model, data, options).Run();
}

}  // namespace trueline
