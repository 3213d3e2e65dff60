// Truncated power series in time, as a scalar: a model evaluated in it yields the series of its
// output, and an ODE its solution's series, coefficient by coefficient. Lie derivatives come out
// as (coefficient i) * i!, without finite differences and without expression swell (Griewank and
// Walther 2008, "Evaluating Derivatives", ch. 13). Coefficients C: double, Modular, Variable
// (reverse mode), or ceres::Jet over any of these.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <type_traits>
#include <utility>

namespace trueline {

// A constant of a coefficient type, also for nested Jets (whose element type is Scalar).
template <class C>
C MakeScalar(double value) {
  if constexpr (requires { typename C::Scalar; }) {
    return C(MakeScalar<typename C::Scalar>(value));
  } else {
    return C(value);
  }
}

// c_0 + c_1 t + ... + c_degree t^degree + O(t^(order + 1)): coefficients above `degree` are zero,
// those above `order` are unknown. A constant has degree 0 and the full order, so products with
// constants are cheap, and a series of a low order costs only that order.
template <class C, int kMaxOrder>
class Taylor {
 public:
  using Coefficient = C;

  Taylor() : Taylor(C(), kMaxOrder) {}
  explicit Taylor(double constant) : Taylor(MakeScalar<C>(constant), kMaxOrder) {}
  Taylor(const Taylor& other) : order_(other.order_), degree_(other.degree_) { CopyFrom(other); }
  Taylor& operator=(const Taylor& other) {
    if (this == &other) return *this;
    order_ = other.order_;
    degree_ = other.degree_;
    CopyFrom(other);
    return *this;
  }
  static Taylor Constant(const C& value) { return Taylor(value, kMaxOrder); }
  // A series of which only the value at t = 0 is known; see Append.
  static Taylor Start(const C& value) { return Taylor(value, 0); }
  // The series t + value, known in full.
  static Taylor Time(const C& value) {
    static_assert(kMaxOrder >= 1);
    Taylor result = Start(value);
    result.Append(MakeScalar<C>(1.0));
    result.order_ = kMaxOrder;
    return result;
  }

  int order() const { return order_; }
  int degree() const { return degree_; }
  // Coefficient of t^i, i <= order().
  C operator[](int i) const { return i <= degree_ ? c_[i] : C(); }
  // Appends the next coefficient; order() must be below kMaxOrder.
  void Append(const C& coefficient) {
    for (int i = degree_ + 1; i <= order_; ++i) Set(i, C());
    Set(++order_, coefficient);
    degree_ = order_;
  }
  // d/dt; the order falls by one.
  Taylor Derivative() const {
    Taylor result;
    result.order_ = order_ == kMaxOrder && degree_ < order_ ? kMaxOrder : order_ - 1;
    result.degree_ = std::max(degree_ - 1, 0);
    for (int i = 1; i <= degree_; ++i) result.Set(i - 1, c_[i] * Whole(i));
    return result;
  }

  friend Taylor operator+(const Taylor& a, const Taylor& b) {
    return Combine(
        a, b, [](const C& x, const C& y) { return x + y; }, [](const C& y) { return y; });
  }
  friend Taylor operator-(const Taylor& a, const Taylor& b) {
    return Combine(
        a, b, [](const C& x, const C& y) { return x - y; }, [](const C& y) { return -y; });
  }
  friend Taylor operator-(const Taylor& a) { return Taylor() - a; }
  friend Taylor operator*(const Taylor& a, const Taylor& b) {
    Taylor result;
    result.order_ = std::min(a.order_, b.order_);
    result.degree_ = std::min(a.degree_ + b.degree_, result.order_);
    for (int k = 0; k <= result.degree_; ++k) {
      const int first = std::max(0, k - b.degree_);
      const int last = std::min(k, a.degree_);
      C sum = a.c_[first] * b.c_[k - first];
      for (int i = first + 1; i <= last; ++i) sum += a.c_[i] * b.c_[k - i];
      result.Set(k, sum);
    }
    return result;
  }
  friend Taylor operator/(const Taylor& a, const Taylor& b) {  // b[0] must not be zero
    Taylor result;
    result.order_ = std::min(a.order_, b.order_);
    result.degree_ = b.degree_ == 0 ? std::min(a.degree_, result.order_) : result.order_;
    const C inverse = MakeScalar<C>(1.0) / b.c_[0];
    for (int k = 0; k <= result.degree_; ++k) {
      C rest = a[k];
      for (int i = 1; i <= std::min(k, b.degree_); ++i) rest -= b.c_[i] * result.c_[k - i];
      result.Set(k, rest * inverse);
    }
    return result;
  }
  Taylor& operator+=(const Taylor& b) { return *this = *this + b; }
  Taylor& operator-=(const Taylor& b) { return *this = *this - b; }
  Taylor& operator*=(const Taylor& b) { return *this = *this * b; }
  Taylor& operator/=(const Taylor& b) { return *this = *this / b; }

  friend Taylor sqrt(const Taylor& a) {  // a[0] > 0
    using std::sqrt;
    Taylor root = a.degree_ == 0 ? Taylor() : Full(a.order_);
    root.order_ = a.order_;
    root.Set(0, sqrt(a.c_[0]));
    const C scale = MakeScalar<C>(0.5) / root.c_[0];
    for (int k = 1; k <= root.degree_; ++k) {
      C rest = a[k];
      for (int i = 1; i < k; ++i) rest -= root.c_[i] * root.c_[k - i];
      root.Set(k, rest * scale);
    }
    return root;
  }
  friend Taylor sin(const Taylor& a) { return SinCos(a).first; }
  friend Taylor cos(const Taylor& a) { return SinCos(a).second; }

 private:
  using Pair = std::pair<Taylor, Taylor>;

  static_assert(std::is_trivially_destructible_v<C>);

  Taylor(const C& value, int order) : order_(order) { Set(0, value); }
  void Set(int i, const C& value) {
    if (i < 0 || i > kMaxOrder) __builtin_unreachable();  // GCC 12 else warns of such an i
    std::construct_at(&c_[i], value);
  }
  // Not inlined: GCC 12 else warns of coefficients that this loop never reaches.
  [[gnu::noinline]] void CopyFrom(const Taylor& other) {
    for (int i = 0; i <= degree_; ++i) Set(i, other.c_[i]);
  }
  static C Whole(int n) { return MakeScalar<C>(n); }
  static Taylor Full(int order) {
    Taylor result;
    result.order_ = result.degree_ = order;
    return result;
  }
  template <class Both, class Second>
  static Taylor Combine(const Taylor& a, const Taylor& b, const Both& both, const Second& second) {
    Taylor result;
    result.order_ = std::min(a.order_, b.order_);
    result.degree_ = std::min(std::max(a.degree_, b.degree_), result.order_);
    const int shared = std::min({a.degree_, b.degree_, result.degree_});
    for (int i = 0; i <= shared; ++i) result.Set(i, both(a.c_[i], b.c_[i]));
    const int last_a = std::min(a.degree_, result.degree_);
    const int last_b = std::min(b.degree_, result.degree_);
    for (int i = shared + 1; i <= last_a; ++i) result.Set(i, a.c_[i]);
    for (int i = shared + 1; i <= last_b; ++i) result.Set(i, second(b.c_[i]));
    return result;
  }
  // s' = c a', c' = -s a'.
  static Pair SinCos(const Taylor& a) {
    using std::cos;
    using std::sin;
    Taylor s = Full(a.degree_ == 0 ? 0 : a.order_);
    Taylor c = s;
    s.order_ = c.order_ = a.order_;
    s.Set(0, sin(a.c_[0]));
    c.Set(0, cos(a.c_[0]));
    for (int k = 1; k <= s.degree_; ++k) {
      C ds = C(), dc = C();
      for (int i = 1; i <= std::min(k, a.degree_); ++i) {
        const C slope = a.c_[i] * Whole(i);
        ds += slope * c.c_[k - i];
        dc -= slope * s.c_[k - i];
      }
      s.Set(k, ds / Whole(k));
      c.Set(k, dc / Whole(k));
    }
    return {s, c};
  }

  int order_ = kMaxOrder;
  int degree_ = 0;
  // Uninitialised storage: coefficients above the degree are never constructed, because Jets are
  // large and most series short.
  union {
    std::array<C, kMaxOrder + 1> c_;
  };
};

}  // namespace trueline

namespace Eigen {
template <class C, int kMaxOrder>
struct NumTraits<trueline::Taylor<C, kMaxOrder>> : GenericNumTraits<double> {
  using Real = trueline::Taylor<C, kMaxOrder>;
  using NonInteger = Real;
  using Nested = const Real&;
  using Literal = Real;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = HugeCost,
    AddCost = HugeCost,
    MulCost = HugeCost
  };
};
}  // namespace Eigen
