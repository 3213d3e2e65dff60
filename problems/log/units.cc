#include "problems/log/units.h"

#include <array>
#include <cmath>

#include "problems/common/units.h"

namespace trueline {
namespace {

struct Unit {
  Dimension dimension;
  std::string_view name;
  double factor;
};

constexpr double kStandardGravity = 9.80665;  // m/s^2, by definition of the unit g

// The SI unit of each dimension comes first.
constexpr auto kUnits = std::to_array<Unit>({
    {Dimension::kNone, "1", 1.0},
    {Dimension::kNone, "%", 1e-2},
    {Dimension::kTime, "s", 1.0},
    {Dimension::kTime, "ms", 1e-3},
    {Dimension::kTime, "us", 1e-6},
    {Dimension::kTime, "ns", 1e-9},
    {Dimension::kLength, "m", 1.0},
    {Dimension::kLength, "cm", 1e-2},
    {Dimension::kLength, "mm", 1e-3},
    {Dimension::kAngle, "rad", 1.0},
    {Dimension::kAngle, "deg", kDegree},
    {Dimension::kAngularRate, "rad/s", 1.0},
    {Dimension::kAngularRate, "deg/s", kDegree},
    {Dimension::kAngularRate, "rpm", kRpm},
    {Dimension::kSpeed, "m/s", 1.0},
    {Dimension::kSpeed, "cm/s", 1e-2},
    {Dimension::kSpeed, "mm/s", 1e-3},
    {Dimension::kAcceleration, "m/s^2", 1.0},
    {Dimension::kAcceleration, "g", kStandardGravity},
    {Dimension::kAcceleration, "cm/s^2", 1e-2},
    {Dimension::kAcceleration, "mm/s^2", 1e-3},
    {Dimension::kVoltage, "V", 1.0},
    {Dimension::kVoltage, "mV", 1e-3},
});

}  // namespace

std::optional<double> UnitFactor(Dimension dimension, std::string_view unit) {
  for (const Unit& known : kUnits) {
    if (known.dimension == dimension && known.name == unit) return known.factor;
  }
  return std::nullopt;
}

std::string SiUnit(Dimension dimension) {
  for (const Unit& known : kUnits) {
    if (known.dimension == dimension) return std::string(known.name);
  }
  return {};
}

std::string KnownUnits(Dimension dimension) {
  std::string names;
  for (const Unit& known : kUnits) {
    if (known.dimension != dimension) continue;
    names += names.empty() ? "" : ", ";
    names += known.name;
  }
  return names;
}

int TimeExponent(double unit_in_seconds) {
  return 9 + static_cast<int>(std::lround(std::log10(unit_in_seconds)));
}

}  // namespace trueline
