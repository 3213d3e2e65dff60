// Errors of a predicted window against the flight, at a few horizons: height [m], velocity [m/s],
// attitude (rotation vector [rad]) and rate [rad/s], each divided by its scale. The horizontal
// position is left out: it would pull the vehicle's numbers to hide what the logged velocity gets
// wrong (room_path.h).
#pragma once

#include "cost_functions/models/window_prediction.h"

namespace trueline {

// The flight at the ends of the steps that are compared.
struct WindowTruth {
  static constexpr std::array<int, 10> kHorizons = {1, 3, 6, 10, 15, 20, 26, 33, 41, 50};
  struct State {
    double z = 0.0;
    Eigen::Vector3d v;
    Eigen::Vector4d q;  // w x y z
    Eigen::Vector3d w;
  };
  std::array<State, kHorizons.size()> states;
};

class MultiStepResidual {
 public:
  static constexpr int kQuantities = 4;  // z, v, R, w
  static constexpr int kResiduals = 3 * kQuantities * int{WindowTruth::kHorizons.size()};
  struct Options {
    std::array<double, kQuantities> scale = {0.032, 0.16, 0.07, 0.4};  // m, m/s, rad, rad/s
    double weight = 1.0;
    // True: each 3-vector e becomes e / sqrt(|e|) (smooth at zero), so that the sum of squares is
    // the sum of norms, as the benchmark's mean absolute errors are.
    bool norms = true;
  };

  MultiStepResidual(const WindowPrediction& prediction, const FreeNumbers& numbers,
                    const PredictionWindow& window, const WindowTruth& truth,
                    const Options& options)
      : prediction_(prediction),
        numbers_(numbers),
        window_(window),
        truth_(truth),
        options_(options) {}

  // x: the free numbers, one block.
  template <class T>
  bool operator()(T const* const* x, T* residuals) const {
    PredictedStates<T> states;
    prediction_.Predict(numbers_.At(x[0]).data(), window_, &states);
    for (std::size_t i = 0; i < WindowTruth::kHorizons.size(); ++i) {
      const PredictedState<T>& state = states[WindowTruth::kHorizons[i] - 1];
      const WindowTruth::State& truth = truth_.states[i];
      T* out = residuals + std::size_t{3} * kQuantities * i;
      Put(Vec3<T>(T(0.0), T(0.0), state.p[2] - T(truth.z)), 0, out);
      Put(Vec3<T>(state.v - truth.v.cast<T>()), 1, out);
      Put(Rotation(truth.q, state.q), 2, out);
      Put(Vec3<T>(state.w - truth.w.cast<T>()), 3, out);
    }
    return true;
  }

 private:
  // The rotation vector from `truth` to `q`; sin(angle / 2) is scaled by angle / 2 over it.
  template <class T>
  static Vec3<T> Rotation(const Eigen::Vector4d& truth, const Vec4<T>& q) {
    using std::atan2;
    using std::sqrt;
    const Vec4<T> e = HamiltonProduct(Conjugate(Vec4<T>(truth.cast<T>())), q);
    const T sine = sqrt(e[1] * e[1] + e[2] * e[2] + e[3] * e[3] + T(1e-16));
    const T factor = T(2.0) * atan2(sine, e[0]) / sine;
    return Vec3<T>(factor * e[1], factor * e[2], factor * e[3]);
  }
  template <class T>
  void Put(const Vec3<T>& error, int quantity, T* residuals) const {
    using std::pow;
    constexpr double kSmooth = 0.1;  // of the scale
    const double scale = options_.weight / options_.scale[quantity];
    T factor(scale);
    if (options_.norms) {
      const double smooth = kSmooth * options_.scale[quantity];
      const T square = error[0] * error[0] + error[1] * error[1] + error[2] * error[2];
      factor = T(std::sqrt(scale)) * pow(square + T(smooth * smooth), -0.25);
    }
    for (int i = 0; i < 3; ++i) residuals[3 * quantity + i] = factor * error[i];
  }

  const WindowPrediction& prediction_;
  const FreeNumbers& numbers_;
  const PredictionWindow& window_;
  const WindowTruth& truth_;
  Options options_;
};

}  // namespace trueline
