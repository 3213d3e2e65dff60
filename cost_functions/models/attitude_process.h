// How a stabilised vehicle's rates move under rotor moments that are known up to a disturbance.
//
// Wakes and gusts push with a moment d that no flight model knows. The controller answers within
// tens of milliseconds: below its bandwidth most of what the rotors do only cancels d. Integrating
// rotor moments as if they turned the vehicle therefore diverges. Here both are Gaussian processes,
// for each axis on its own:
//   tilt (or heading)  theta: k(s) = a^2 exp(-s^2 / 2 l^2); the vehicle is held near level
//   rate               w = theta' + jitter, jitter: exponential covariance, sigma j a / l, time t_j
//   disturbance        d = dw/dt - net: a constant, an exponential and a white part
// `net` is the angular acceleration by the model. What is observed at a window's start, theta_0 and
// w_0, and the window's 50 net accelerations give the expected rates by linear regression
// (Rasmussen and Williams 2006, eq. 2.23). The size a of the manoeuvre is unknown: a few sizes are
// mixed by their (tempered) likelihood.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

namespace trueline {

struct AttitudeProcessNumbers {
  double length = 0.36;        // l, s
  double jitter = 0.5;         // j, 1
  double jitter_time = 0.04;   // t_j, s
  double constant = 12.0;      // sigma of the disturbance that lasts, rad/s^2
  double coloured = 3.6;       // sigma of its exponential part, rad/s^2
  double coloured_time = 0.2;  // s
  double white = 5.5;          // sigma of a step's mean, rad/s^2
  // The disturbance grows with the manoeuvre: times sqrt(1 + (growth a)^2), 1/rad.
  double growth = 3.5;
  double temper = 0.25;                                  // power of the likelihood
  std::array<double, 4> sizes = {0.03, 0.08, 0.2, 0.5};  // a, rad
};

// One axis over one window of kSteps steps of kStep seconds.
class AttitudeProcess {
 public:
  static constexpr int kSteps = 50;
  static constexpr double kStep = 0.01;         // s
  static constexpr int kObserved = kSteps + 2;  // theta_0, w_0, net of each step
  static constexpr int kSizes = 4;

  explicit AttitudeProcess(const AttitudeProcessNumbers& numbers) : temper_(numbers.temper) {
    for (int i = 0; i < kSizes; ++i) experts_[i] = MakeExpert(numbers, numbers.sizes[i]);
  }

  // Expected rates at the ends of the steps [rad/s]. `observed`, `rates`: a column for each axis of
  // a group that shares the size of the manoeuvre (roll and pitch), kObserved and kSteps long.
  template <class T>
  void Expect(const std::vector<std::vector<T>>& observed,
              std::vector<std::vector<T>>* rates) const;

 private:
  struct Expert {
    Eigen::MatrixXd gain;       // kSteps x kObserved
    Eigen::MatrixXd precision;  // kObserved x kObserved
    double log_determinant = 0.0;
  };
  static Expert MakeExpert(const AttitudeProcessNumbers& n, double size);

  template <class T>
  std::array<T, kSizes> Shares(const std::vector<std::vector<T>>& observed) const;

  double temper_;
  std::array<Expert, kSizes> experts_;
};

namespace attitude_process {

inline double Value(double x) { return x; }
template <class Jet>
double Value(const Jet& x) {
  return x.a;
}

template <class T>
Eigen::VectorXd Values(const std::vector<T>& x) {
  Eigen::VectorXd values(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) values[i] = Value(x[i]);
  return values;
}

}  // namespace attitude_process

inline AttitudeProcess::Expert AttitudeProcess::MakeExpert(const AttitudeProcessNumbers& n,
                                                           double size) {
  constexpr int kRates = kSteps + 1;
  const double rate = size / n.length, jitter = n.jitter * rate;
  const double disturbance = 1.0 + std::pow(n.growth * size, 2);
  Eigen::MatrixXd rates(kRates, kRates), pushes(kSteps, kSteps);
  Eigen::VectorXd tilt(kRates);  // covariance of theta_0 with w_k
  for (int i = 0; i < kRates; ++i) {
    const double t = i * kStep;
    tilt[i] = -rate * rate * t * std::exp(-0.5 * std::pow(t / n.length, 2));
    for (int j = 0; j < kRates; ++j) {
      const double s = std::abs(i - j) * kStep, r2 = std::pow(s / n.length, 2);
      rates(i, j) = rate * rate * (1.0 - r2) * std::exp(-0.5 * r2) +
                    jitter * jitter * std::exp(-s / n.jitter_time);
      if (i == kSteps || j == kSteps) continue;
      pushes(i, j) = n.constant * n.constant +
                     n.coloured * n.coloured * std::exp(-s / n.coloured_time) +
                     (i == j ? n.white * n.white : 0.0);
    }
  }
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(kSteps + 1, kRates);  // w_0 and dw/dt from rates
  H(0, 0) = 1.0;
  for (int k = 0; k < kSteps; ++k) {
    H(k + 1, k) = -1.0 / kStep;
    H(k + 1, k + 1) = 1.0 / kStep;
  }
  constexpr double kTiltError = 0.03, kRateError = 0.01;  // rad, rad/s, of the given state
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(kObserved, kObserved), X(kSteps, kObserved);
  C(0, 0) = size * size + kTiltError * kTiltError;
  C.row(0).tail(kSteps + 1) = (H * tilt).transpose();
  C.col(0).tail(kSteps + 1) = H * tilt;
  C.bottomRightCorner(kSteps + 1, kSteps + 1) = H * rates * H.transpose();
  C.bottomRightCorner(kSteps, kSteps) += disturbance * pushes;
  C(1, 1) += kRateError * kRateError;
  X << tilt.tail(kSteps), (rates * H.transpose()).bottomRows(kSteps);
  const Eigen::LLT<Eigen::MatrixXd> llt(C);
  Expert expert;
  expert.gain = llt.solve(X.transpose()).transpose();
  expert.precision = llt.solve(Eigen::MatrixXd::Identity(kObserved, kObserved));
  expert.log_determinant = 2.0 * llt.matrixLLT().diagonal().array().log().sum();
  return expert;
}

// Weights of the sizes; their derivatives follow the observations' to first order.
template <class T>
std::array<T, AttitudeProcess::kSizes> AttitudeProcess::Shares(
    const std::vector<std::vector<T>>& observed) const {
  using std::exp;
  std::array<T, kSizes> score;
  for (int e = 0; e < kSizes; ++e) {
    score[e] = T(0.0);
    for (const std::vector<T>& axis : observed) {
      const Eigen::VectorXd x = attitude_process::Values(axis), g = experts_[e].precision * x;
      score[e] += T(-0.5 * (x.dot(g) + experts_[e].log_determinant));
      for (int k = 0; k < kObserved; ++k) score[e] += T(-g[k]) * (axis[k] - T(x[k]));
    }
    score[e] *= T(temper_);
  }
  double most = attitude_process::Value(score[0]);
  for (const T& s : score) most = std::max(most, attitude_process::Value(s));
  T sum(0.0);
  for (T& s : score) sum += s = exp(s - T(most));
  for (T& s : score) s /= sum;
  return score;
}

template <class T>
void AttitudeProcess::Expect(const std::vector<std::vector<T>>& observed,
                             std::vector<std::vector<T>>* rates) const {
  const std::array<T, kSizes> share = Shares(observed);
  Eigen::MatrixXd gain = Eigen::MatrixXd::Zero(kSteps, kObserved);
  for (int e = 0; e < kSizes; ++e) gain += attitude_process::Value(share[e]) * experts_[e].gain;
  rates->assign(observed.size(), std::vector<T>(kSteps, T(0.0)));
  for (std::size_t a = 0; a < observed.size(); ++a) {
    std::vector<T>& rate = (*rates)[a];
    for (int i = 0; i < kSteps; ++i) {
      for (int k = 0; k < kObserved; ++k) rate[i] += T(gain(i, k)) * observed[a][k];
    }
    const Eigen::VectorXd x = attitude_process::Values(observed[a]);
    for (int e = 0; e < kSizes; ++e) {
      const T change = share[e] - T(attitude_process::Value(share[e]));
      const Eigen::VectorXd mean = experts_[e].gain * x;
      for (int i = 0; i < kSteps; ++i) rate[i] += change * T(mean[i]);
    }
  }
}

}  // namespace trueline
