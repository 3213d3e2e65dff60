#include "problems/log/units.h"

#include <array>
#include <cmath>

#include "problems/common/units.h"

namespace trueline {
namespace {

struct Unit {
  std::string_view si, name;
  double factor;
};

constexpr double kStandardGravity = 9.80665;  // m/s^2, by definition of the unit g

// Every SI unit converts to itself, whether it is here or not.
constexpr auto kUnits = std::to_array<Unit>({
    {"1", "%", 1e-2},
    {"s", "ms", 1e-3},
    {"s", "us", 1e-6},
    {"s", "ns", 1e-9},
    {"m", "cm", 1e-2},
    {"m", "mm", 1e-3},
    {"rad", "deg", kDegree},
    {"rad/s", "deg/s", kDegree},
    {"rad/s", "rpm", kRpm},
    {"m/s", "cm/s", 1e-2},
    {"m/s", "mm/s", 1e-3},
    {"m/s^2", "g", kStandardGravity},
    {"m/s^2", "cm/s^2", 1e-2},
    {"m/s^2", "mm/s^2", 1e-3},
    {"V", "mV", 1e-3},
});

}  // namespace

std::optional<double> UnitFactor(std::string_view si, std::string_view unit) {
  if (unit == si) return 1.0;
  for (const Unit& known : kUnits) {
    if (known.si == si && known.name == unit) return known.factor;
  }
  return std::nullopt;
}

std::string KnownUnits(std::string_view si) {
  std::string names(si);
  for (const Unit& known : kUnits) {
    if (known.si == si) names.append(", ").append(known.name);
  }
  return names;
}

int TimeExponent(double unit_in_seconds) {
  return 9 + static_cast<int>(std::lround(std::log10(unit_in_seconds)));
}

}  // namespace trueline
