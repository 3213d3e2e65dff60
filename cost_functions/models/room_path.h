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
                 const std::array<std::array<T, kSteps>, 2>& v) const {
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
                           const std::function<Rows(double)>& wanted, double length) {
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

  std::array<Expert, kLengths> experts_;
};

// A logged velocity that its filter fuses from a sensor of a wrong scale (optical flow) and from
// positions: fast motion shows the sensor's scale, slow motion the positions'. Over a change d of
// position per second
//   v(s) = (1 + g B(s)) exp(-s lag) d(s),  B: high-pass of order two (Butterworth) of a time T
// so that the share of v with which the position moves depends on how fast the path swings. A state
// does not tell that; it is expected from v and from the changes of v that a model predicts.

struct FusedVelocityNumbers {
  double excess = 0.0;  // g, 1
  double time = 1.0;    // T, s
  double lag = 0.0;     // s
};

class FusedVelocity {
 public:
  static constexpr int kSteps = 50;
  template <class T>
  using Axis = std::array<T, kSteps>;

  explicit FusedVelocity(const FusedVelocityNumbers& numbers)
      : path_([&](double w) { return Response(numbers, w); },
              [&](double w) {
                const auto rest = (1.0 - Response(numbers, w)) / std::complex<double>(0.0, w);
                RoomPath<kSteps>::Rows ways;
                for (int k = 0; k < kSteps; ++k) {
                  ways[k] = (std::polar(1.0, w * (k + 1) * kPathStep) - 1.0) * rest;
                }
                return ways;
              }) {}

  // The change of position from the start to the end of each step minus the integral of v [m].
  // `v0`: at the start, `v`: at the ends of the steps [m/s], of both horizontal axes.
  template <class T>
  std::array<Axis<T>, 2> Correction(const std::array<double, 2>& v0,
                                    const std::array<Axis<T>, 2>& v) const {
    return path_.Expect(v0, v);
  }

  // v over d at the angular frequency w [rad/s].
  static std::complex<double> Response(const FusedVelocityNumbers& n, double w) {
    const std::complex<double> s(0.0, w * n.time), high = s * (s + M_SQRT2);
    return (1.0 + n.excess * high / (1.0 + high)) * std::polar(1.0, -n.lag * w);
  }

 private:
  RoomPath<kSteps> path_;
};

// The part of a horizontal velocity that lies above the bandwidth of a filter on board.
//
// A filter that is fed positions and knows no drag takes what drag does below its bandwidth for a
// tilt: its tilt lacks k u / g, where k [1/s] is the drag and u = v / (1 + s T) the slow part of
// the velocity v. From such a tilt drag acts on the fast part X = v - u only, and the tilt falls
// behind the gyroscopes by k / g du/dt = k / (g T) X. X depends on the past of v; it is expected
// from v and from the changes of v that a model predicts.

class FastVelocity {
 public:
  static constexpr int kSteps = 50;
  // At the start, then at the ends of the steps, of both horizontal axes [m/s].
  template <class T>
  using Axes = std::array<std::array<T, kSteps + 1>, 2>;

  explicit FastVelocity(double time = 1.0)
      : time_(time),
        path_([](double) { return std::complex<double>(1.0); },
              [&](double w) {
                const auto response = Response(time, w);
                RoomPath<kSteps + 1>::Rows fast;
                for (int k = 0; k <= kSteps; ++k) {
                  fast[k] = response * std::polar(1.0, w * k * kPathStep);
                }
                return fast;
              }) {}

  double time() const { return time_; }  // T, s

  // X. `v0`: at the start, `v`: at the ends of the steps [m/s].
  template <class T>
  Axes<T> Expect(const std::array<double, 2>& v0,
                 const std::array<std::array<T, kSteps>, 2>& v) const {
    return path_.Expect(v0, v);
  }

 private:
  // X over v, behind the low-pass by which the filter smooths.
  static std::complex<double> Response(double time, double w) {
    constexpr double kSmoothing = 10.0;  // rad/s
    const std::complex<double> s(0.0, w), r = s / kSmoothing;
    return s * time / (1.0 + s * time) / (1.0 + 1.4 * r + r * r);
  }

  double time_;
  RoomPath<kSteps + 1> path_;
};

}  // namespace trueline
