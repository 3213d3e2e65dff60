// Terms of the open catalogue as the models compute them: a coefficient times a product of factors,
// which acts as a force or a moment along an axis of the vehicle or the earth, or as an error of an
// attitude or a fix.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <tuple>
#include <vector>

#include "cost_functions/models/rotation.h"

namespace trueline {

// A function of a template's scalar that is chosen at run time: a generic lambda, kept once for
// each scalar of a list. In<T> is the argument, Out<T> the result.
template <template <class> class In, template <class> class Out, class... Scalars>
class ForScalars {
 public:
  template <class Function>
  explicit ForScalars(const Function& function) : by_scalar_{Of<Scalars>(function)...} {}

  template <class T>
  Out<T> operator()(const In<T>& in) const {
    return std::get<Of<T>>(by_scalar_)(in);
  }

 private:
  template <class T>
  using Of = std::function<Out<T>(const In<T>&)>;

  std::tuple<Of<Scalars>...> by_scalar_;
};

// Specific force [m/s^2], angular acceleration [rad/s^2], logged attitude [rad], fix [m]; what a
// sensor reads, of which no model can hold a term: specific force [m/s^2], turn rate [rad/s].
enum class TermOn { kForce, kTurn, kAttitude, kFix, kAccelerometer, kGyro };

enum class TermQuantity {
  kSpeedX,  // m/s, over ground, in body axes
  kSpeedY,
  kSpeedZ,
  kRateX,  // rad/s
  kRateY,
  kRateZ,
  kThrust,   // m/s^2, less at[0]
  kSine,     // of at[0] times the heading
  kCosine,   // likewise
  kNorth,    // m, beyond at[0]
  kEast,     // likewise
  kHeight,   // likewise
  kTime,     // from at[0] on, in units of at[1]; s
  kVoltage,  // V, above at[0]
  kPlace,    // a hump around (at[0], at[1]) of radius at[2]; at[3]: power of its edge, 2 if absent
  kSlopeNorth,  // metres north of the middle of such a hump, times the hump
  kSlopeEast,
  kGateDistance,  // m
};

// What the log alone shows, evenly in time.
struct TermSeries {
  double start = 0.0, step = 1.0;  // s, from the log's start
  std::vector<double> values;      // not empty

  double At(double t) const {
    const double last = static_cast<double>(values.size() - 1);
    const double at = std::clamp((t - start) / step, 0.0, last);
    const auto i = static_cast<std::size_t>(std::min(at, std::max(0.0, last - 1.0)));
    if (i + 1 >= values.size()) return values.back();
    return values[i] + (at - static_cast<double>(i)) * (values[i + 1] - values[i]);
  }
};

struct TermFactor {
  TermQuantity of;
  std::vector<double> at = {};
  bool size = false;  // the absolute value
  double lag = 0.0;   // s, of a first order; 0: none
  // Of a quantity that the state does not hold: voltage, and all that lags.
  std::shared_ptr<const TermSeries> series = nullptr;

  bool NeedsSeries() const { return lag > 0.0 || of == TermQuantity::kVoltage; }
};

// How the vehicle moves at one time.
template <typename T>
struct TermState {
  Vector3<T> v_B = Vector3<T>::Zero();  // m/s, over ground
  Vector3<T> w_B = Vector3<T>::Zero();  // rad/s
  T thrust = T(0);                      // m/s^2
  Matrix3<T> R_E_B = Matrix3<T>::Identity();
  Vector3<T> p_E = Vector3<T>::Zero();                // m
  double t = 0.0;                                     // s, from the log's start
  Eigen::Vector3d to_gate = Eigen::Vector3d::Zero();  // m, in E; zero without a gate
};

template <typename T>
T PlaceOf(const TermFactor& factor, const TermState<T>& state) {
  using std::exp;
  using std::pow;
  const T x = (state.p_E[0] - T(factor.at[0])) / T(factor.at[2]);
  const T y = (state.p_E[1] - T(factor.at[1])) / T(factor.at[2]);
  const T square = x * x + y * y;
  const bool flat = factor.at.size() > 3 && factor.at[3] > 2.0;
  return exp(flat ? T(-pow(square, 0.5 * factor.at[3])) : T(-square));
}

// Of the heading, by the double angle where it is taken twice.
template <typename T>
T WaveOf(const TermFactor& factor, const TermState<T>& state) {
  using std::sqrt;
  const T x = state.R_E_B(0, 0), y = state.R_E_B(1, 0);
  const T length = sqrt(x * x + y * y + T(1e-12));
  const T c = x / length, s = y / length;
  const bool twice = factor.at[0] > 1.0;
  if (factor.of == TermQuantity::kSine) return twice ? T(T(2) * s * c) : s;
  return twice ? T(c * c - s * s) : c;
}

template <typename T>
T ValueOf(const TermFactor& factor, const TermState<T>& state) {
  using enum TermQuantity;
  const auto from = [&](const T& value) { return T(value - T(factor.at[0])); };
  const int which = static_cast<int>(factor.of);
  if (factor.series) return T(factor.series->At(state.t));
  switch (factor.of) {
    case kSpeedX:
    case kSpeedY:
    case kSpeedZ:
      return state.v_B[which];
    case kRateX:
    case kRateY:
    case kRateZ:
      return state.w_B[which - static_cast<int>(kRateX)];
    case kThrust:
      return from(state.thrust);
    case kSine:
    case kCosine:
      return WaveOf(factor, state);
    case kNorth:
      return from(state.p_E[0]);
    case kEast:
      return from(state.p_E[1]);
    case kHeight:
      return from(-state.p_E[2]);
    case kTime:
      return T((state.t - factor.at[0]) / factor.at[1]);
    case kPlace:
      return PlaceOf(factor, state);
    case kSlopeNorth:
      return from(state.p_E[0]) * PlaceOf(factor, state);
    case kSlopeEast:
      return T(state.p_E[1] - T(factor.at[1])) * PlaceOf(factor, state);
    case kGateDistance:
      return T(state.to_gate.norm());
    case kVoltage:
      break;
  }
  return T(0);  // a voltage without its series
}

template <typename T>
T ValueOf(const std::vector<TermFactor>& factors, const TermState<T>& state) {
  T product(1);
  for (const TermFactor& factor : factors) {
    const T value = ValueOf(factor, state);
    product *= factor.size && value < T(0) ? T(-value) : value;
  }
  return product;
}

// `axis`: 0 to 2 of B, 3 to 5 north, east, down, 6 towards the gate.
template <typename T>
Vector3<T> AlongInBody(int axis, const T& size, const TermState<T>& state) {
  if (axis == 6) {
    const Vector3<T> towards = state.to_gate.stableNormalized().template cast<T>();
    return state.R_E_B.transpose() * towards * size;
  }
  if (axis >= 3) return state.R_E_B.row(axis - 3).transpose() * size;
  Vector3<T> along = Vector3<T>::Zero();
  along[axis] = size;
  return along;
}

// A term with its size.
struct SizedTerm {
  TermOn on = TermOn::kForce;
  int axis = 0;
  std::vector<TermFactor> with = {};
  double size = 0.0;

  template <typename T>
  Vector3<T> InBody(const TermState<T>& state) const {
    return AlongInBody(axis, T(ValueOf(with, state) * T(size)), state);
  }
};

// Of all terms that enter at `on`, in body axes.
template <typename T>
Vector3<T> SumInBody(const std::vector<SizedTerm>& terms, TermOn on, const TermState<T>& state) {
  Vector3<T> sum = Vector3<T>::Zero();
  for (const SizedTerm& term : terms) {
    if (term.on == on) sum += term.InBody(state);
  }
  return sum;
}

}  // namespace trueline
