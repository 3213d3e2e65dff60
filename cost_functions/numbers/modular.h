// Numbers modulo the prime p = 2^61 - 1: exact arithmetic for generic ranks (Sedoglavic 2002, "A
// probabilistic algorithm to test local algebraic observability in polynomial time"). A rank found
// at a random point of GF(p) can be too small with a probability of about degree / p < 1e-14, and
// is never too large for the given coefficients (unless p divides one of them).
#pragma once

#include <Eigen/Core>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string_view>

namespace trueline {

class Modular {
 public:
  static constexpr std::uint64_t kPrime = (std::uint64_t{1} << 61) - 1;

  constexpr Modular() = default;
  // The shortest decimal number that reads back as `value`, as a fraction: 0.071 is 71/1000, so 0.1
  // + 0.2 is 0.3. Not for infinities or NaN.
  explicit Modular(double value) : Modular(FromDouble(value)) {}
  // Any residue; reduced.
  static constexpr Modular FromResidue(std::uint64_t residue) {
    Modular result;
    result.value_ = residue % kPrime;
    return result;
  }

  constexpr std::uint64_t value() const { return value_; }
  constexpr bool operator==(const Modular& other) const = default;

  friend constexpr Modular operator+(Modular a, Modular b) {
    const std::uint64_t sum = a.value_ + b.value_;
    return Raw(sum >= kPrime ? sum - kPrime : sum);
  }
  friend constexpr Modular operator-(Modular a, Modular b) {
    return Raw(a.value_ >= b.value_ ? a.value_ - b.value_ : a.value_ + kPrime - b.value_);
  }
  friend constexpr Modular operator-(Modular a) { return Modular() - a; }
  friend constexpr Modular operator*(Modular a, Modular b) {
    const Wide product = static_cast<Wide>(a.value_) * b.value_;  // below 2^122
    const std::uint64_t folded =
        static_cast<std::uint64_t>(product & kPrime) + static_cast<std::uint64_t>(product >> 61);
    return Raw(folded >= kPrime ? folded - kPrime : folded);
  }
  // b must not be zero: zero has no inverse, and the result would be 0.
  friend constexpr Modular operator/(Modular a, Modular b) { return a * b.Power(kPrime - 2); }
  constexpr Modular& operator+=(Modular b) { return *this = *this + b; }
  constexpr Modular& operator-=(Modular b) { return *this = *this - b; }
  constexpr Modular& operator*=(Modular b) { return *this = *this * b; }
  constexpr Modular& operator/=(Modular b) { return *this = *this / b; }

  constexpr Modular Power(std::uint64_t exponent) const {
    Modular result = Raw(1);
    for (Modular square = *this; exponent > 0; exponent >>= 1, square *= square) {
      if (exponent & 1) result *= square;
    }
    return result;
  }

 private:
  __extension__ using Wide = unsigned __int128;

  static constexpr Modular Raw(std::uint64_t value) {
    Modular result;
    result.value_ = value;
    return result;
  }
  static constexpr Modular FromInteger(std::int64_t value) {
    return value < 0 ? -FromResidue(static_cast<std::uint64_t>(-value))
                     : FromResidue(static_cast<std::uint64_t>(value));
  }
  static Modular FromDouble(double value) {
    if (std::abs(value) < 1e15 && value == std::floor(value)) {
      return FromInteger(static_cast<std::int64_t>(value));
    }
    std::array<char, 32> buffer;
    const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                   std::chars_format::scientific)
                         .ptr;
    return FromScientific({buffer.data(), static_cast<std::size_t>(end - buffer.data())});
  }
  // Reads "-1.25e-03" exactly.
  static Modular FromScientific(std::string_view text) {
    const std::size_t mark = text.find('e');
    std::string_view power = text.substr(mark + 1);
    if (power.front() == '+') power.remove_prefix(1);
    int exponent = 0;
    std::from_chars(power.data(), power.data() + power.size(), exponent);
    std::int64_t digits = 0;
    bool after_point = false;
    for (const char c : text.substr(0, mark)) {
      if (c == '.') after_point = true;
      if (c < '0' || c > '9') continue;
      digits = 10 * digits + (c - '0');
      exponent -= after_point ? 1 : 0;
    }
    const Modular scale = Raw(10).Power(static_cast<std::uint64_t>(std::abs(exponent)));
    const Modular magnitude = FromInteger(text.front() == '-' ? -digits : digits);
    return exponent < 0 ? magnitude / scale : magnitude * scale;
  }

  std::uint64_t value_ = 0;
};

// Sine and cosine of an unknown angle: a point of the circle that depends on the angle only, (0, 1)
// for zero. Sines of independent random angles are algebraically independent, so generic ranks are
// correct provided that no formula relies on addition theorems between arguments.
inline Modular HalfAngleTangent(Modular angle) {
  return angle * (angle * angle + Modular::FromResidue(0x9e3779b97f4a7c15ULL));
}
inline Modular sin(Modular angle) {
  const Modular t = HalfAngleTangent(angle), one(1.0);
  return (t + t) / (one + t * t);
}
inline Modular cos(Modular angle) {
  const Modular t = HalfAngleTangent(angle), one(1.0);
  return (one - t * t) / (one + t * t);
}

}  // namespace trueline

namespace Eigen {
template <>
struct NumTraits<trueline::Modular> : GenericNumTraits<trueline::Modular> {
  using Real = trueline::Modular;
  using NonInteger = trueline::Modular;
  using Nested = trueline::Modular;
  using Literal = trueline::Modular;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 0,
    RequireInitialization = 1,
    ReadCost = 1,
    AddCost = 3,
    MulCost = 6
  };
};
}  // namespace Eigen
