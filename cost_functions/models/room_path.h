// What a horizontal velocity, known at a few times of half a second, tells of the path: anything
// that depends linearly on the path is expected from it, such as the way or a filtered velocity.
//
// The flight stays within a room. Its position on each axis is a Gaussian process with
// k(s) = A^2 exp(-s^2 / 2 L^2), A = 0.6 m: who is fast in a room turns soon. The size is known
// within a factor (Student-t process). A few L are mixed by their (tempered) likelihood, both axes
// together.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <complex>
#include <functional>

namespace trueline {

inline constexpr double kPathStep = 0.01;  // s

// Expects kRows quantities of each axis.
template <int kRows>
class RoomPath {
 public:
  static constexpr int kSteps = 50;
  template <class T>
  using Axes = std::array<std::array<T, kRows>, 2>;
  using Rows = Eigen::Matrix<std::complex<double>, kRows, 1>;

  // `seen`(w) is the velocity that is given over the path's own, at the angular frequency
  // w [rad/s]; `wanted`(w) is what is expected over the path's velocity at the start.
  RoomPath(const std::function<std::complex<double>(double)>& seen,
           const std::function<Rows(double)>& wanted) {
    for (int i = 0; i < kLengths; ++i) experts_[i] = MakeExpert(seen, wanted, 0.25 * (1 << i));
  }

  // `v0`: at the start, `v`: at the ends of the steps [m/s], of both axes.
  template <class T>
  Axes<T> Expect(const std::array<double, 2>& v0,
                 const std::array<std::array<T, kSteps>, 2>& v) const;

 private:
  static constexpr int kLengths = 5;                                     // 0.25 to 4 s
  static constexpr std::array<int, 5> kObserved = {10, 20, 30, 40, 50};  // steps, of v - v_0
  static constexpr int kSeen = 1 + static_cast<int>(kObserved.size());
  struct Expert {
    Eigen::Matrix<double, kRows, kSeen> gain;
    Eigen::Matrix<double, kSeen, kSeen> precision;
    double log_determinant = 0.0;
  };
  static Expert MakeExpert(const std::function<std::complex<double>(double)>& seen,
                           const std::function<Rows(double)>& wanted, double length);

  std::array<Expert, kLengths> experts_;
};

template <int kRows>
auto RoomPath<kRows>::MakeExpert(const std::function<std::complex<double>(double)>& seen,
                                 const std::function<Rows(double)>& wanted, double length)
    -> Expert {
  constexpr int kFrequencies = 400;
  constexpr double kRoom = 0.6;                       // A, m
  constexpr double kNoise = 0.02, kModelError = 0.1;  // m/s of v; m/s^2 of what a model predicts
  Eigen::MatrixXcd given(kSeen, kFrequencies), rows(kRows, kFrequencies);
  Eigen::VectorXd place(kFrequencies), squares(kFrequencies);  // powers of the position; w^2
  for (int i = 0; i < kFrequencies; ++i) {
    const double w = (i + 0.5) * 6.0 / length / kFrequencies;
    given(0, i) = seen(w);
    for (int k = 1; k < kSeen; ++k) {
      given(k, i) = given(0, i) * (std::polar(1.0, w * kObserved[k - 1] * kPathStep) - 1.0);
    }
    rows.col(i) = wanted(w);
    place[i] = std::exp(-0.5 * std::pow(w * length, 2));
    squares[i] = w * w;
  }
  const Eigen::VectorXd power = kRoom * kRoom / place.sum() * place.cwiseProduct(squares);
  const Eigen::MatrixXcd weighted = power.asDiagonal() * given.adjoint();
  Eigen::Matrix<double, kSeen, kSeen> cov = (given * weighted).real();
  cov(0, 0) += kNoise * kNoise;
  for (int k = 1; k < kSeen; ++k) {
    cov(k, k) += std::pow(kNoise + kModelError * kObserved[k - 1] * kPathStep, 2);
  }
  const Eigen::LLT<Eigen::Matrix<double, kSeen, kSeen>> llt(cov);
  Expert expert;
  expert.precision = llt.solve(Eigen::Matrix<double, kSeen, kSeen>::Identity());
  expert.gain = (rows * weighted).real() * expert.precision;
  expert.log_determinant = 2.0 * llt.matrixLLT().diagonal().array().log().sum();
  return expert;
}

template <int kRows>
template <class T>
auto RoomPath<kRows>::Expect(const std::array<double, 2>& v0,
                             const std::array<std::array<T, kSteps>, 2>& v) const -> Axes<T> {
  using std::exp;
  using std::log;
  constexpr double kTemper = 0.5, kFreedom = 20.0;  // of the size's prior
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
  for (T& s : shares) s /= sum;
  Axes<T> all;
  for (int a = 0; a < 2; ++a) {
    for (int row = 0; row < kRows; ++row) {
      T& mean = all[a][row] = T(0.0);
      for (int e = 0; e < kLengths; ++e) {
        T expected(0.0);
        for (int k = 0; k < kSeen; ++k) expected += T(experts_[e].gain(row, k)) * seen[a][k];
        mean += shares[e] * expected;
      }
    }
  }
  return all;
}

}  // namespace trueline
