#include "problems/vgd/vgd_kinematic.h"

#include <ceres/ceres.h>
#include <ceres/jet.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>

#include "cost_functions/models/rotation.h"
#include "problems/common/random.h"
#include "problems/result/identifiability.h"
#include "problems/vgd/drive_track.h"
#include "problems/vgd/rough_path.h"
#include "problems/vgd/solver_options.h"
#include "problems/vgd/window_estimate.h"

namespace trueline {
namespace {

using BiasJet = ceres::Jet<double, 6>;  // b_a, b_g

// Value and derivatives of three numbers.
void Split(const Vector3<BiasJet>& x, Eigen::Vector3d* value, Eigen::Matrix3d* d_ba,
           Eigen::Matrix3d* d_bg) {
  for (int i = 0; i < 3; ++i) {
    (*value)[i] = x[i].a;
    d_ba->row(i) = x[i].v.head<3>().transpose();
    d_bg->row(i) = x[i].v.tail<3>().transpose();
  }
}

}  // namespace

KinematicBlock SumUp(const ImuInputs& imu, TimeNs t0, TimeNs t1) {
  ImuBias<BiasJet> bias;
  for (int i = 0; i < 3; ++i) {
    bias.accel[i] = BiasJet(0.0, i);
    bias.gyro[i] = BiasJet(0.0, 3 + i);
  }
  KinematicBlock block;
  KinematicState<BiasJet> x;
  imu.ForEachStep(t0, t1, [&](const ImuInput& input, double dt) {
    const Eigen::Quaterniond q(x.q_E_I.w().a, x.q_E_I.x().a, x.q_E_I.y().a, x.q_E_I.z().a);
    const Eigen::Vector3d half_turn = input.gyro * (0.25 * dt);
    const Eigen::Quaterniond q_mid = q * RotationFromHalfVector<double>(half_turn);
    block.R_tau_dt += q_mid.toRotationMatrix() * ((block.h + 0.5 * dt) * dt);
    KinematicStep(input, bias, 0.0, dt, &x);
    block.h += dt;
  });
  Split(x.v, &block.v, &block.d_v_ba, &block.d_v_bg);
  Split(x.p, &block.p, &block.d_p_ba, &block.d_p_bg);
  const Eigen::Quaternion<BiasJet>& q = x.q_E_I;
  block.turn = Eigen::Quaterniond(q.w().a, q.x().a, q.y().a, q.z().a).normalized();
  const Eigen::Quaternion<BiasJet> error = block.turn.conjugate().cast<BiasJet>() * q;
  Eigen::Vector3d none;
  Eigen::Matrix3d no_effect;
  Split(error.vec() * BiasJet(2.0), &none, &no_effect, &block.d_turn_bg);
  return block;
}

Eigen::MatrixXd PathDeviations(const std::vector<KinematicNode>& nodes, const ImuNoise& noise,
                               double gravity) {
  const auto count = static_cast<Eigen::Index>(nodes.size());
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(6 * count, 6 * count);
  const Eigen::Vector3d g(0.0, 0.0, gravity);
  const double sigma_gyro = std::sqrt(noise.GyroSpectrum().mean());
  for (Eigen::Index k = 0; k + 1 < count; ++k) {
    const double root = std::sqrt(nodes[k + 1].elapsed - nodes[k].elapsed);
    const auto& from = nodes[k].value;
    for (Eigen::Index i = k + 1; i < count; ++i) {
      const double t = nodes[i].elapsed - nodes[k].elapsed;
      const auto& to = nodes[i].value;
      const Eigen::Vector3d V = to.tail<3>() - from.tail<3>() - g * t;
      const Eigen::Vector3d P =
          to.head<3>() - from.head<3>() - from.tail<3>() * t - g * (0.5 * t * t);
      auto effect = D.block<6, 6>(6 * i, 6 * k);
      effect.topLeftCorner<3, 3>() = Skew<double>(P) * (-sigma_gyro * root);
      effect.bottomLeftCorner<3, 3>() = Skew<double>(V) * (-sigma_gyro * root);
      effect.topRightCorner<3, 3>() = Eigen::Matrix3d::Identity() * (noise.accel * root * t);
      effect.bottomRightCorner<3, 3>() = Eigen::Matrix3d::Identity() * (noise.accel * root);
    }
  }
  return D;
}

namespace {

using ThetaJet = ceres::Jet<double, kKinematicThetaSize>;

// Times of all fixes and the end, and points every 0.1 s for noise and trajectory.
std::vector<TimeNs> TimesOf(std::span<const Fix> fixes, TimeNs end) {
  constexpr TimeNs kSpacing = kNsPerSecond / 10;
  std::vector<TimeNs> times;
  for (const Fix& fix : fixes) times.push_back(fix.t);
  for (TimeNs t = times.front(); t < end; t += kSpacing) times.push_back(t);
  times.push_back(end);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

void Store(const KinematicState<double>& x, KinematicNode* node) { node->value << x.p, x.v; }

void Store(const KinematicState<ThetaJet>& x, KinematicNode* node) {
  for (int i = 0; i < 3; ++i) {
    node->value[i] = x.p[i].a;
    node->value[i + 3] = x.v[i].a;
    node->d_theta.row(i) = x.p[i].v.transpose();
    node->d_theta.row(i + 3) = x.v[i].v.transpose();
  }
}

// The least-squares problem of one window under the kinematic model (eq. 28-30 with eq. 37-38 of
// Li et al. 2019): biases and start from fixes.
class KinematicWindow : private ceres::EvaluationCallback {
 public:
  using Theta = Eigen::Matrix<double, kKinematicThetaSize, 1>;
  using State = Eigen::Matrix<double, kKinematicStateSize, 1>;
  static constexpr int kAsked = kKinematicThetaSize + kKinematicStateSize;

  // From the first fix to `end`. Loss, whitening, solver and use of the ranges are `vgd`'s. The
  // track gives the AHRS's attitude at the start.
  KinematicWindow(const ImuInputs& imu, std::span<const Fix> fixes, TimeNs end,
                  const VgdOptions& vgd, const KinematicOptions& options)
      : vgd_(vgd),
        options_(options),
        chain_(imu, fixes.front().t, TimesOf(fixes, end), vgd.max_block),
        gravity_(imu.track().gravity()),
        q_Ep_I_(imu.AhrsAttitudeAt(fixes.front().t)),
        nodes_(chain_.times().size()),
        problem_(ProblemOptions(this)) {
    sigma_ << Eigen::Vector3d::Constant(options.accel_bias_sigma),
        Eigen::Vector3d::Constant(options.gyro_bias_sigma), options.tilt_sigma, options.tilt_sigma,
        options.heading_sigma;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      nodes_[i].elapsed = SecondsBetween(chain_.start(), chain_.times()[i]);
    }
    AddResiduals(fixes);
  }
  KinematicWindow(const KinematicWindow&) = delete;
  KinematicWindow& operator=(const KinematicWindow&) = delete;

  // Where the search begins: theta in its own units, p and v at the window's start.
  void SetStart(const Theta& theta, const State& state) {
    theta_ = theta.cwiseQuotient(sigma_);
    state_ = state;
  }
  ceres::Solver::Summary Solve() {
    ceres::Solver::Summary summary;
    ceres::Solve(SolverOptions(vgd_, ceres::DENSE_QR), &problem_, &summary);
    Refresh(true);
    return summary;
  }

  // b_a (m/s^2), b_g (rad/s), Phi_E_Ep at the start (rad).
  Theta Parameters() const { return sigma_.cwiseProduct(theta_); }
  const Theta& prior_sigma() const { return sigma_; }
  // How many of the parameters are free: six without the initial attitude.
  int free_parameters() const {
    return options_.initial_attitude ? kKinematicThetaSize : kImuBiasSize;
  }

  // Covariance of (theta in units of its prior sigmas, p and v at the end): the fixes' part by the
  // Gauss-Newton Hessian, and the effect of IMU noise on the path, within the fit and after it.
  Eigen::Matrix<double, kAsked, kAsked> Covariance() {
    ceres::Problem::EvaluateOptions options;
    options.parameter_blocks = {theta_.data(), state_.data()};
    ceres::CRSMatrix crs;
    problem_.Evaluate(options, nullptr, nullptr, nullptr, &crs);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(crs.num_rows, crs.num_cols);
    for (int row = 0; row < crs.num_rows; ++row) {
      for (int k = crs.rows[row]; k < crs.rows[row + 1]; ++k) J(row, crs.cols[k]) = crs.values[k];
    }
    const int free = free_parameters();
    Eigen::MatrixXd H = J.transpose() * J;
    if (vgd_.ranges != RangeUse::kPrior) {
      const double weight = WindowProblem::PriorWeight(vgd_);
      H.diagonal().head(free).array() += weight * weight;
    }
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(free + kKinematicStateSize, kAsked);
    G.topLeftCorner(free, free).setIdentity();
    const KinematicNode& end = nodes_.back();
    G.topRightCorner(free, 6) = end.d_theta.leftCols(free).transpose();
    G.bottomRightCorner<6, 6>() = end.d_state().transpose();
    // Full rank: priors hold theta (very wide ones where the fit has none), and two fixes apart in
    // time hold p and v.
    const Eigen::MatrixXd inverse_G = H.completeOrthogonalDecomposition().solve(G);
    const Eigen::MatrixXd bent = FitDeviations(J, inverse_G.transpose() * J.transpose());
    return G.transpose() * inverse_G + bent * bent.transpose();
  }

  // p and v (in E) at each of times().
  const std::vector<KinematicNode>& nodes() const { return nodes_; }
  const std::vector<TimeNs>& times() const { return chain_.times(); }
  Eigen::Vector3d PositionAt(TimeNs t) const { return nodes_[IndexOf(t)].value.head<3>(); }

 private:
  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override {
    if (new_evaluation_point || evaluate_jacobians) Refresh(evaluate_jacobians);
  }

  std::size_t IndexOf(TimeNs t) const {
    const auto it = std::lower_bound(times().begin(), times().end(), t);
    CHECK(it != times().end() && *it == t) << "the window has no node at that time";
    return static_cast<std::size_t>(it - times().begin());
  }

  void AddResiduals(std::span<const Fix> fixes) {
    problem_.AddParameterBlock(theta_.data(), kKinematicThetaSize);
    problem_.AddParameterBlock(state_.data(), kKinematicStateSize);
    for (const Fix& fix : fixes) {
      const double sigma = vgd_.whiten ? fix.sigma : 1.0;
      fix_nodes_.push_back(IndexOf(fix.t));
      problem_.AddResidualBlock(
          new KinematicFixResidual(&nodes_[fix_nodes_.back()], fix.p_E, sigma),
          MakeLoss(vgd_.loss, vgd_.loss_scale), theta_.data(), state_.data());
    }
    AddPriors();
  }

  void AddPriors() {
    constexpr int kSize = kKinematicThetaSize;
    if (vgd_.ranges == RangeUse::kPrior) {
      problem_.AddResidualBlock(
          new ceres::NormalPrior(Eigen::MatrixXd::Identity(kSize, kSize), Theta::Zero()), nullptr,
          theta_.data());
    }
    if (!options_.initial_attitude) {
      std::vector<int> attitude;
      for (int i = kImuBiasSize; i < kSize; ++i) attitude.push_back(i);
      problem_.SetManifold(theta_.data(), new ceres::SubsetManifold(kSize, attitude));
    }
    if (!vgd_.HasBounds()) return;
    for (int i = 0; i < kKinematicThetaSize; ++i) {
      problem_.SetParameterLowerBound(theta_.data(), i, -KinematicOptions::kBoundSigmas);
      problem_.SetParameterUpperBound(theta_.data(), i, KinematicOptions::kBoundSigmas);
    }
  }

  template <typename T>
  void Integrate(const Eigen::Matrix<T, kKinematicThetaSize, 1>& theta) {
    ImuBias<T> bias;
    bias.accel = theta.template head<3>();
    bias.gyro = theta.template segment<3>(3);
    KinematicState<T> x;
    x.p = state_.head<3>().cast<T>();
    x.v = state_.tail<3>().cast<T>();
    const Vector3<T> Phi_E_Ep = theta.template tail<3>();
    x.q_E_I = QuaternionFromEuler<T>(Phi_E_Ep) * q_Ep_I_.cast<T>();
    chain_.Integrate(bias, x,
                     [&](std::size_t i, const KinematicState<T>& at) { Store(at, &nodes_[i]); });
  }

  void Refresh(bool derivatives) {
    const Theta theta = Parameters();
    if (!derivatives) return Integrate<double>(theta);
    Eigen::Matrix<ThetaJet, kKinematicThetaSize, 1> jets;
    for (int i = 0; i < kKinematicThetaSize; ++i) {
      jets[i] = ThetaJet(theta[i]);
      jets[i].v[i] = sigma_[i];
    }
    Integrate<ThetaJet>(jets);
  }

  // Errors of the requested quantities by unit noises of the IMU (columns): the path's deviations
  // act through the fit's gain, and directly at the window's end. J: whitened Jacobian, the fixes'
  // rows first.
  Eigen::MatrixXd FitDeviations(const Eigen::MatrixXd& J, const Eigen::MatrixXd& gain) const {
    const Eigen::MatrixXd path = PathDeviations(nodes_, options_.noise, gravity_);
    const int first_state = static_cast<int>(J.cols()) - kKinematicStateSize;
    Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(kAsked, path.cols());
    for (std::size_t i = 0; i < fix_nodes_.size(); ++i) {
      const int row = static_cast<int>(3 * i), node = static_cast<int>(6 * fix_nodes_[i]);
      // The start position adds to every fix: its columns are the fix's weights, robust loss
      // included.
      const Eigen::Matrix3d weight = J.block<3, 3>(row, first_state);
      errors += gain.middleCols<3>(row) * weight * path.middleRows<3>(node);
    }
    errors.bottomRows<6>() -= path.bottomRows<6>();
    return errors;
  }

  VgdOptions vgd_;
  KinematicOptions options_;
  KinematicChain chain_;
  double gravity_;
  Eigen::Quaterniond q_Ep_I_;  // at the window's start
  Theta sigma_;
  Theta theta_ = Theta::Zero();  // in prior sigmas
  State state_ = State::Zero();
  std::vector<KinematicNode> nodes_;
  ceres::Problem problem_;
  std::vector<std::size_t> fix_nodes_;  // by fix
};

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
