// A logged velocity that its filter fuses from a sensor of a wrong scale (optical flow) and from
// positions: fast motion shows the sensor's scale, slow motion the positions'. Over a change d of
// position per second
//   v(s) = (1 + g B(s)) exp(-s lag) d(s),  B: high-pass of order two (Butterworth) of a time T
// so that the share of v with which the position moves depends on how fast the path swings. A state
// does not tell that; it is expected from v and from the changes of v that a model predicts
// (room_path.h).
#pragma once

#include <array>
#include <cmath>
#include <complex>

#include "cost_functions/models/room_path.h"

namespace trueline {

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

}  // namespace trueline
