#include "problems/rotor_ekf/rotor_ekf.h"

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
using Disturbance = Eigen::Matrix<double, kNoise, 1>;

class Filter {
 public:
  Filter(const Model& model, const RotorData& data, const RotorEkfOptions& options)
      : model_(model), data_(data), options_(options) {
    x_ = Joined(RoughNodes(data, options.prior.mean).front(), options.prior.mean);
    RotorError sigma;
    sigma << Eigen::Vector3d::Constant(options.sigma_attitude),
        Eigen::Vector3d::Constant(options.sigma_position),
        Eigen::Vector3d::Constant(options.sigma_velocity),
        Eigen::Vector3d::Constant(options.sigma_rate), options.prior.sigma;
    cov_ = sigma.cwiseAbs2().asDiagonal();
  }

  RotorEkfRun Run() {
    RotorEkfRun run;
    std::size_t imu = 0;
    double t = data_.poses.front().t;
    while (imu < data_.imu.size() && data_.imu[imu].t < t) ++imu;
    for (std::size_t i = 0; i < data_.poses.size(); ++i) {
      UpdateWithPose(data_.poses[i]);
      run.history.push_back(Estimate(data_.poses[i].t));
      if (i + 1 < data_.poses.size()) Propagate(data_.poses[i + 1].t, &t, &imu);
    }
    run.state = x_;
    run.cov = cov_;
    run.log_likelihood = log_likelihood_;
    return run;
  }

 private:
  // Through all IMU samples up to the time `end`.
  void Propagate(double end, double* t, std::size_t* imu) {
    while (*t < end - 1e-9) {
      const bool sample = *imu < data_.imu.size() && data_.imu[*imu].t <= *t + 1e-9;
      if (sample) ++*imu;
      double next = std::min(end, *t + kLongestStep);
      if (*imu < data_.imu.size()) next = std::min(next, data_.imu[*imu].t);
      Step(*t, next - *t, sample ? &data_.imu[*imu - 1] : nullptr);
      *t = next;
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
    SeedErrors(x_, x.data());
    model_.Imu(x.data(), data_.InputAt(t), y.data());
    Eigen::Matrix<double, 6, 1> innovation, sigma;
    sigma << Eigen::Vector3d::Constant(options_.noise.accel),
        Eigen::Vector3d::Constant(options_.noise.gyro);
    AugmentedRows H;
    H.rightCols<kNoise>() = DisturbanceFeedthrough(x_);
    for (int i = 0; i < 6; ++i) {
      innovation[i] = (i < 3 ? imu.accel[i] : imu.gyro[i - 3]) - y[i].a;
      H.row(i).head<kErrors>() = y[i].v.transpose();
    }
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
    SeedErrors(x_, x.data());
    RotorMidpointStep(model_, data_.InputAt(t + 0.5 * dt), disturbance.data(), dt, x.data());
    Eigen::Matrix<double, kMoving, kErrors + kNoise> F;
    F.leftCols<kErrors>() = MovingSensitivity(x.data());
    F.rightCols<kNoise>() = DisturbanceInput(x_, dt);
    const Eigen::Matrix<double, kMoving, kErrors + kNoise> FP = F * cov;
    cov_ = cov.topLeftCorner<kErrors, kErrors>();
    cov_.topRows<kMoving>() = FP.leftCols<kErrors>();
    cov_.leftCols<kMoving>() = cov_.topRows<kMoving>().transpose().eval();
    cov_.topLeftCorner<kMoving, kMoving>() = FP * F.transpose();
    const double wander = options_.wander * options_.wander * dt;
    cov_.diagonal().tail<Model::kConstants>() += wander * options_.prior.sigma.cwiseAbs2();
    cov_ = (0.5 * (cov_ + cov_.transpose())).eval();
    for (int i = 0; i < Model::kStates; ++i) x_[i] = x[i].a;
    x_.head<4>().normalize();
    if (!x_.allFinite()) {
      throw InputError(fmt::format(
          "the filter diverged after {:.2f} s; widen priors or noise, or check frames and rotors",
          t));
    }
  }

  void UpdateWithPose(const RotorPose& pose) {
    const int rows = data_.attitude ? 6 : 3;
    std::array<RotorJet, Model::kStates> x;
    std::array<RotorJet, 6> error;
    SeedErrors(x_, x.data());
    PoseError(pose, data_.attitude, options_.noise, x.data(), error.data());
    Eigen::Matrix<double, Eigen::Dynamic, kErrors, 0, 6> H(rows, kErrors);
    Eigen::VectorXd innovation(rows);
    for (int i = 0; i < rows; ++i) {
      H.row(i) = error[i].v.transpose();
      innovation[i] = -error[i].a;
    }
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
    log_likelihood_ -= 0.5 * squared + std::log(root_determinant);
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
  double log_likelihood_ = 0.0;
};

}  // namespace

RotorEkfRun RunRotorEkf(const RotorAeroModel& model, const RotorData& data,
                        const RotorEkfOptions& options) {
  return Filter(model, data, options).Run();
}

}  // namespace trueline
