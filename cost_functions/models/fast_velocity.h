// The part of a horizontal velocity that lies above the bandwidth of a filter on board.
//
// A filter that is fed positions and knows no drag takes what drag does below its bandwidth for a
// tilt: its tilt lacks k u / g, where k [1/s] is the drag and u = v / (1 + s T) the slow part of
// the velocity v. From such a tilt drag acts on the fast part X = v - u only, and the tilt falls
// behind the gyroscopes by k / g du/dt = k / (g T) X. X depends on the past of v; it is expected
// from v and from the changes of v that a model predicts (room_path.h).
#pragma once

#include <array>
#include <complex>

#include "cost_functions/models/room_path.h"

namespace trueline {

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
