// Units that logs may state, with their factors to SI.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace trueline {

enum class Dimension {
  kNone,
  kTime,
  kLength,
  kAngle,
  kAngularRate,
  kSpeed,
  kAcceleration,
  kVoltage
};

// Factor from `unit` to the SI unit of `dimension`; no value if it is not a unit of that dimension.
std::optional<double> UnitFactor(Dimension dimension, std::string_view unit);

std::string SiUnit(Dimension dimension);
std::string KnownUnits(Dimension dimension);  // "m/s^2, g, ...", for messages

// Of a unit of time in nanoseconds, for ParseTime: 9 for a unit of 1 s, 6 for 1e-3 s.
int TimeExponent(double unit_in_seconds);

}  // namespace trueline
