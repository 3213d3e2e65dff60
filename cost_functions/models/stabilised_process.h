// How a stabilised vehicle moves under moments that are known up to a disturbance.
//
// Wakes and gusts push with a moment d that no flight model knows. The controller answers within
// tens of milliseconds: below its bandwidth most of what the rotors do only cancels d. Integrating
// rotor moments as if they turned the vehicle therefore diverges. Here both are Gaussian processes,
// for each axis on its own (roll, pitch, heading):
//   angle        theta: k(s) = a^2 exp(-s^2 / 2 l^2); the vehicle is held near level
//   return       a tilt has a second part, du/dt for the velocity u = v / g along which the tilt
//                accelerates. u: k(s) = (b a L)^2 exp(-s^2 / 2 L^2). The flight stays within a
//                room, so a vehicle that is fast now brakes within about L
//   rate         w = theta' + jitter, jitter: exponential covariance, sigma j a / l, time t_j
//   disturbance  d = dw/dt - net: a constant, an exponential and a white part
// `net` is the acceleration by the model. What is observed at a window's start, theta_0, w_0 and
// u_0, and the window's 50 net accelerations give the expected rates by linear regression
// (Rasmussen and Williams 2006, eq. 2.23). The size a of the manoeuvre is unknown, and so is the
// time L of the return: how soon a flight turns back depends on its course. A few sizes and times
// are mixed by their (tempered) likelihood.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

namespace trueline {

struct StabilisedProcessNumbers {
  double length = 0.36;        // l, s
  double jitter = 0.5;         // j, 1
  double jitter_time = 0.04;   // t_j, s
  double constant = 12.0;      // sigma of the disturbance that lasts, rad/s^2
  double coloured = 3.6;       // sigma of its exponential part, rad/s^2
  double coloured_time = 0.2;  // s
  double white = 5.5;          // sigma of a step's mean, rad/s^2
  // The disturbance grows with the manoeuvre: times sqrt(1 + (growth a)^2), 1/rad.
  double growth = 3.5;
  double returning = 0.0;                                // b, 1; 0: no velocity is used
  double return_time = 0.6;                              // the middle one of L, s
  double cruise = 1.0;                                   // sigma of a lasting v, of b a L g
  double temper = 0.25;                                  // power of the likelihood
  std::array<double, 4> sizes = {0.03, 0.08, 0.2, 0.5};  // a, rad
};

// One axis over one window of kSteps steps of kStep seconds.
class StabilisedProcess {
 public:
  static constexpr int kSteps = 50;
  static constexpr double kStep = 0.01;         // s
  static constexpr int kObserved = kSteps + 3;  // theta_0, w_0, net of each step, v_0 / g

  explicit StabilisedProcess(const StabilisedProcessNumbers& numbers) : temper_(numbers.temper) {
    const std::vector<double> factors = numbers.returning > 0.0
                                            ? std::vector<double>{0.4, 0.63, 1.0, 1.6, 2.5}
                                            : std::vector<double>{1.0};
    for (const double factor : factors) {
      StabilisedProcessNumbers n = numbers;
      n.return_time *= factor;
      for (const double size : n.sizes) experts_.push_back(MakeExpert(n, size));
    }
  }

  // Expected rates at the ends of the steps [rad/s]. `observed`, `rates`: a column for each axis of
  // a group that shares the size of the manoeuvre (roll and pitch), kObserved and kSteps long.
  template <class T>
  void Expect(const std::vector<std::vector<T>>& observed,
              std::vector<std::vector<T>>* rates) const {
    const std::vector<T> share = Shares(observed);
    Eigen::MatrixXd gain = Eigen::MatrixXd::Zero(kSteps, kObserved);
    for (std::size_t e = 0; e < experts_.size(); ++e) {
      gain += Value(share[e]) * experts_[e].gain;
    }
    rates->assign(observed.size(), std::vector<T>(kSteps, T(0.0)));
    for (std::size_t a = 0; a < observed.size(); ++a) {
      std::vector<T>& rate = (*rates)[a];
      for (int i = 0; i < kSteps; ++i) {
        for (int k = 0; k < kObserved; ++k) rate[i] += T(gain(i, k)) * observed[a][k];
      }
      const Eigen::VectorXd x = Values(observed[a]);
      for (std::size_t e = 0; e < experts_.size(); ++e) {
        const T change = share[e] - T(Value(share[e]));
        const Eigen::VectorXd mean = experts_[e].gain * x;
        for (int i = 0; i < kSteps; ++i) rate[i] += change * T(mean[i]);
      }
    }
  }

  // Variances, at the ends of the steps, of the errors of an axis' rate [(rad/s)^2], of its angle
  // [rad^2] and of the angle's first and second integral [(rad s)^2, (rad s^2)^2], about what
  // Expect expects: those of each expert (Rasmussen and Williams 2006, eq. 2.24), and the experts'
  // spread about their mean. An expert's are as much larger as the squares of what is observed are
  // than it expects, as a Student-t process has it (Shah et al. 2014, lemma 3). The window's start
  // is exact.
  using Spread = std::array<Eigen::Vector4d, kSteps>;
  std::vector<Spread> Spreads(const std::vector<std::vector<double>>& observed) const {
    const std::vector<double> share = Shares(observed);
    std::vector<double> scale(experts_.size());
    for (const auto& axis : observed) {
      const Eigen::Map<const Eigen::VectorXd> x(axis.data(), kObserved);
      for (std::size_t e = 0; e < experts_.size(); ++e) {
        scale[e] +=
            x.dot(experts_[e].precision * x) / static_cast<double>(kObserved * observed.size());
      }
    }
    std::vector<Spread> spreads(observed.size());
    for (std::size_t a = 0; a < observed.size(); ++a) {
      const Eigen::Map<const Eigen::VectorXd> x(observed[a].data(), kObserved);
      std::vector<Integrals> means(experts_.size());
      Integrals mean = Integrals::Zero();
      for (std::size_t e = 0; e < experts_.size(); ++e)
        mean += share[e] * (means[e] = Integrate(experts_[e].gain * x));
      for (int k = 0; k < kSteps; ++k) {
        spreads[a][k].setZero();
        for (std::size_t e = 0; e < experts_.size(); ++e) {
          const Eigen::Vector4d apart = means[e].col(k) - mean.col(k);
          spreads[a][k] += share[e] * (scale[e] * experts_[e].spread[k] + apart.cwiseAbs2());
        }
      }
    }
    return spreads;
  }

 private:
  static double Value(double x) { return x; }
  template <class Jet>
  static double Value(const Jet& x) {
    return x.a;
  }
  template <class T>
  static Eigen::VectorXd Values(const std::vector<T>& x) {
    Eigen::VectorXd values(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) values[i] = Value(x[i]);
    return values;
  }

  // Of one size and one time of the return.
  struct Expert {
    Eigen::MatrixXd gain;       // kSteps x kObserved
    Eigen::MatrixXd precision;  // kObserved x kObserved
    double log_determinant = 0.0;
    Spread spread;
  };
  // Rate, angle and its integrals at the ends of the steps (rows) from the rates there (columns).
  using Integrals = Eigen::Matrix<double, 4, kSteps>;
  static Integrals Integrate(const Eigen::VectorXd& rates) {
    Integrals all;
    Eigen::Vector4d last = Eigen::Vector4d::Zero();
    for (int k = 0; k < kSteps; ++k) {
      Eigen::Vector4d next(rates[k], 0.0, 0.0, 0.0);
      for (int i = 1; i < 4; ++i) next[i] = last[i] + 0.5 * kStep * (last[i - 1] + next[i - 1]);
      all.col(k) = last = next;
    }
    return all;
  }
  // Covariances of angle, rate and velocity at two times of one size of manoeuvre.
  struct Kernel {
    Kernel(const StabilisedProcessNumbers& n, double size)
        : l(n.length),
          L(n.return_time),
          a2(size * size),
          b2(std::pow(n.returning * size, 2)),
          jitter2(std::pow(n.jitter * size / n.length, 2)),
          jitter_time(n.jitter_time) {}

    // theta(0) with theta'(t).
    double AngleWithRate(double t) const {
      return -a2 * t / (l * l) * Bell(t / l) -
             b2 * t / (L * L) * (3.0 - Square(t / L)) * Bell(t / L);
    }
    // w(0) with w(t).
    double Rates(double t) const {
      const double r = Square(t / l), s = Square(t / L);
      return a2 / (l * l) * (1.0 - r) * Bell(t / l) +
             b2 / (L * L) * (3.0 - 6.0 * s + s * s) * Bell(t / L) +
             jitter2 * std::exp(-std::abs(t) / jitter_time);
    }
    // u(0) with theta'(t).
    double SpeedWithRate(double t) const { return -b2 * (1.0 - Square(t / L)) * Bell(t / L); }

    static double Square(double x) { return x * x; }
    static double Bell(double x) { return std::exp(-0.5 * x * x); }

    double l, L, a2, b2, jitter2, jitter_time;
  };
  static Expert MakeExpert(const StabilisedProcessNumbers& n, double size) {
    constexpr int kRates = kSteps + 1, kLast = kObserved - 1;
    // Of the given state: theta_0, rad; w_0, rad/s; u_0, s.
    constexpr double kTiltError = 0.03, kRateError = 0.01, kSpeedError = 0.003;
    const Kernel kernel(n, size);
    Eigen::MatrixXd rates(kRates, kRates), pushes(kSteps, kSteps);
    Eigen::VectorXd tilt(kRates), speed(kRates);  // covariance of theta_0, and of u_0, with rates
    for (int i = 0; i < kRates; ++i) {
      tilt[i] = kernel.AngleWithRate(i * kStep);
      speed[i] = kernel.SpeedWithRate(i * kStep);
      for (int j = 0; j < kRates; ++j) rates(i, j) = kernel.Rates((j - i) * kStep);
    }
    const double disturbance = 1.0 + std::pow(n.growth * size, 2);
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; j < kSteps; ++j) {
        const double s = std::abs(i - j) * kStep;
        pushes(i, j) = n.constant * n.constant +
                       n.coloured * n.coloured * std::exp(-s / n.coloured_time) +
                       (i == j ? n.white * n.white : 0.0);
      }
    }
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(kRates, kRates);  // w_0 and dw/dt from rates
    H(0, 0) = 1.0;
    for (int k = 0; k < kSteps; ++k) {
      H(k + 1, k) = -1.0 / kStep;
      H(k + 1, k + 1) = 1.0 / kStep;
    }
    Eigen::MatrixXd C = Eigen::MatrixXd::Zero(kObserved, kObserved);
    C(0, 0) = kernel.a2 + kernel.b2 + kTiltError * kTiltError;
    C.block(1, 0, kRates, 1) = H * tilt;
    C.block(1, 1, kRates, kRates) = H * rates * H.transpose();
    C.block(2, 2, kSteps, kSteps) += disturbance * pushes;
    C(1, 1) += kRateError * kRateError;
    C.block(kLast, 1, 1, kRates) = (H * speed).transpose();
    C(kLast, kLast) =
        kernel.b2 * kernel.L * kernel.L * (1.0 + n.cruise * n.cruise) + kSpeedError * kSpeedError;
    C.triangularView<Eigen::StrictlyUpper>() = C.transpose().eval();
    Eigen::MatrixXd X(kSteps, kObserved);  // covariance of the rates with what is observed
    X << tilt.tail(kSteps), (rates * H.transpose()).bottomRows(kSteps), speed.tail(kSteps);
    const Eigen::LLT<Eigen::MatrixXd> llt(C);
    Expert expert;
    expert.gain = llt.solve(X.transpose()).transpose();
    expert.precision = llt.solve(Eigen::MatrixXd::Identity(kObserved, kObserved));
    expert.log_determinant = 2.0 * llt.matrixLLT().diagonal().array().log().sum();
    const Eigen::MatrixXd left =
        rates.bottomRightCorner(kSteps, kSteps) - expert.gain * X.transpose();
    std::array<Integrals, kSteps> of_rate;
    for (int j = 0; j < kSteps; ++j) of_rate[j] = Integrate(Eigen::VectorXd::Unit(kSteps, j));
    for (int k = 0; k < kSteps; ++k) {
      Eigen::Matrix<double, 4, kSteps> map;
      for (int j = 0; j < kSteps; ++j) map.col(j) = of_rate[j].col(k);
      expert.spread[k] = (map * left * map.transpose()).diagonal();
    }
    return expert;
  }

  // Weights of the experts; their derivatives follow the observations' to first order.
  template <class T>
  std::vector<T> Shares(const std::vector<std::vector<T>>& observed) const {
    using std::exp;
    std::vector<T> score(experts_.size());
    for (std::size_t e = 0; e < experts_.size(); ++e) {
      score[e] = T(0.0);
      for (const std::vector<T>& axis : observed) {
        const Eigen::VectorXd x = Values(axis), g = experts_[e].precision * x;
        score[e] += T(-0.5 * (x.dot(g) + experts_[e].log_determinant));
        for (int k = 0; k < kObserved; ++k) score[e] += T(-g[k]) * (axis[k] - T(x[k]));
      }
      score[e] *= T(temper_);
    }
    double most = Value(score[0]);
    for (const T& s : score) most = std::max(most, Value(s));
    T sum(0.0);
    for (T& s : score) sum += s = exp(s - T(most));
    for (T& s : score) s /= sum;
    return score;
  }

  double temper_;
  std::vector<Expert> experts_;
};

}  // namespace trueline
