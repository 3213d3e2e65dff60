// A logged velocity that its filter fuses from a sensor of a wrong scale (optical flow) and from
// positions: fast motion shows the sensor's scale, slow motion the positions'. Over a change d of
// position per second
//   v(s) = (1 + g B(s)) exp(-s lag) d(s),  B: high-pass of order two (Butterworth) of a time T
// so that the share of v with which the position moves depends on how fast the path swings. A state
// does not tell that; it is expected from v and from the changes of v that a model predicts. The
// path's velocity is a Gaussian process, k(s) = exp(-s^2 / 2 L^2), of unknown size; a few L are
// mixed by their (tempered) likelihood, horizontal axes together.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <complex>
#include <utility>
#include <vector>

namespace trueline {

struct FusedVelocityNumbers {
  double excess = 0.0;  // g, 1
  double time = 1.0;    // T, s
  double lag = 0.0;     // s
};

// v over d at the angular frequency w [rad/s]: real and imaginary part.
template <class T>
std::pair<T, T> FusedVelocityResponse(const T& excess, const T& time, const T& lag, double w) {
  using std::cos;
  using std::sin;
  const T x = time * T(w), x2 = x * x, scale = excess / (T(1.0) + x2 * x2);
  const T re = T(1.0) + scale * x2 * (T(1.0) + x2), im = scale * T(M_SQRT2) * x;
  const T c = cos(lag * T(w)), s = sin(lag * T(w));
  return {re * c + im * s, im * c - re * s};
}

class FusedVelocity {
 public:
  static constexpr int kSteps = 50;
  static constexpr double kStep = 0.01;                                  // s
  static constexpr std::array<int, 5> kObserved = {10, 20, 30, 40, 50};  // steps, of v - v_0
  template <class T>
  using Axis = std::array<T, kSteps>;

  explicit FusedVelocity(const FusedVelocityNumbers& numbers) {
    for (int i = 0; i < kLengths; ++i) experts_[i] = MakeExpert(numbers, 0.25 * (1 << i));
  }

  // The change of position from the start to the end of each step minus the integral of v [m].
  // `v0`: at the start, `v`: at the ends of the steps [m/s], of both horizontal axes.
  template <class T>
  std::array<Axis<T>, 2> Correction(const std::array<double, 2>& v0,
                                    const std::array<Axis<T>, 2>& v) const;

 private:
  static constexpr int kLengths = 5;  // 0.25 to 4 s
  static constexpr int kSeen = 1 + static_cast<int>(kObserved.size());
  struct Expert {
    Eigen::Matrix<double, kSteps, kSeen> gain;
    Eigen::Matrix<double, kSeen, kSeen> precision;
    double log_determinant = 0.0;
  };
  static Expert MakeExpert(const FusedVelocityNumbers& numbers, double length);

  std::array<Expert, kLengths> experts_;
};

inline FusedVelocity::Expert FusedVelocity::MakeExpert(const FusedVelocityNumbers& numbers,
                                                       double length) {
  using Complex = std::complex<double>;
  constexpr int kFrequencies = 400;
  constexpr double kNoise = 0.02, kModelError = 0.1;  // m/s of v; m/s^2 of what a model predicts
  Eigen::MatrixXcd seen(kSeen, kFrequencies), moved(kSteps, kFrequencies);
  Eigen::VectorXd power(kFrequencies);
  for (int i = 0; i < kFrequencies; ++i) {
    const double w = (i + 0.5) * 6.0 / length / kFrequencies;
    const auto [re, im] = FusedVelocityResponse(numbers.excess, numbers.time, numbers.lag, w);
    const Complex response(re, im);
    const auto change = [&](int step) { return std::polar(1.0, w * step * kStep) - 1.0; };
    seen(0, i) = response;
    for (int k = 1; k < kSeen; ++k) seen(k, i) = response * change(kObserved[k - 1]);
    for (int k = 0; k < kSteps; ++k) {
      moved(k, i) = change(k + 1) / Complex(0.0, w) * (1.0 - response);
    }
    power[i] = std::exp(-0.5 * std::pow(w * length, 2));
  }
  power /= power.sum();
  const Eigen::MatrixXcd weighted = power.asDiagonal() * seen.adjoint();
  Eigen::Matrix<double, kSeen, kSeen> cov = (seen * weighted).real();
  cov(0, 0) += kNoise * kNoise;
  for (int k = 1; k < kSeen; ++k) {
    cov(k, k) += std::pow(kNoise + kModelError * kObserved[k - 1] * kStep, 2);
  }
  const Eigen::LLT<Eigen::Matrix<double, kSeen, kSeen>> llt(cov);
  Expert expert;
  expert.precision = llt.solve(Eigen::Matrix<double, kSeen, kSeen>::Identity());
  expert.gain = (moved * weighted).real() * expert.precision;
  expert.log_determinant = 2.0 * llt.matrixLLT().diagonal().array().log().sum();
  return expert;
}

template <class T>
std::array<FusedVelocity::Axis<T>, 2> FusedVelocity::Correction(
    const std::array<double, 2>& v0, const std::array<Axis<T>, 2>& v) const {
  using std::exp;
  using std::log;
  constexpr double kTemper = 0.5, kFreedom = 4.0;  // of the size's prior, about 1 m/s
  std::array<std::array<T, kSeen>, 2> seen;
  for (int a = 0; a < 2; ++a) {
    seen[a][0] = T(v0[a]);
    for (int k = 1; k < kSeen; ++k) seen[a][k] = v[a][kObserved[k - 1] - 1] - T(v0[a]);
  }
  const auto share = [&](const Expert& expert) {
    T square(kFreedom);
    for (const auto& y : seen) {
      for (int i = 0; i < kSeen; ++i) {
        for (int k = 0; k < kSeen; ++k) square += T(expert.precision(i, k)) * y[i] * y[k];
      }
    }
    return T(
        exp(T(-kTemper) * (T(expert.log_determinant) + T(0.5 * kFreedom + kSeen) * log(square))));
  };
  std::array<T, kLengths> shares;
  T sum(0.0);
  for (int e = 0; e < kLengths; ++e) sum += shares[e] = share(experts_[e]);
  std::array<Axis<T>, 2> correction;
  for (int a = 0; a < 2; ++a) {
    for (int step = 0; step < kSteps; ++step) {
      T& moved = correction[a][step] = T(0.0);
      for (int e = 0; e < kLengths; ++e) {
        T expected(0.0);
        for (int k = 0; k < kSeen; ++k) expected += T(experts_[e].gain(step, k)) * seen[a][k];
        moved += shares[e] / sum * expected;
      }
    }
  }
  return correction;
}

}  // namespace trueline
