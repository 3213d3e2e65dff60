// The units that logs may state, and their size in SI.
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

// Value of one `unit` in the SI unit of `dimension`; nothing where it is not a unit of it.
std::optional<double> UnitFactor(Dimension dimension, std::string_view unit);

std::string SiUnit(Dimension dimension);
std::string KnownUnits(Dimension dimension);  // "m/s^2, g, ...", for messages

// Of a unit of time in nanoseconds, for ParseTime: 9 for a unit of 1 s, 6 for 1e-3 s.
int TimeExponent(double unit_in_seconds);

}  // namespace trueline
