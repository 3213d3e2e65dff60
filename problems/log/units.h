// Units that logs may state, with their factors to SI.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace trueline {

// Factor from `unit` to the SI unit `si`; no value if the one can't be converted to the other.
std::optional<double> UnitFactor(std::string_view si, std::string_view unit);

std::string KnownUnits(std::string_view si);  // "m/s^2, g, ...", for messages

// Of a unit of time in nanoseconds, for ParseTime: 9 for a unit of 1 s, 6 for 1e-3 s.
int TimeExponent(double unit_in_seconds);

}  // namespace trueline
