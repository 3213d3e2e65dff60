// Units that logs may state, with their factors to SI.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "problems/common/units.h"

namespace trueline {

// Factor from `unit` to the SI unit `si`; no value if the one can't be converted to the other.
std::optional<double> UnitFactor(std::string_view si, std::string_view unit);

std::string KnownUnits(std::string_view si);  // "m/s^2, g, ...", for messages

// Of a unit of time in nanoseconds, for ParseTime: 9 for a unit of 1 s, 6 for 1e-3 s.
int TimeExponent(double unit_in_seconds);

// Dates and times of day as text.

// "2024-05-01T23:59:55.25Z" (ISO 8601; a blank for the T, slashes, a zone as +02:00, none for UTC),
// "05/20/2024 01:00:00 PM" or "20.05.2024 13:00:00" since 1970; "23:59:55.25" since midnight,
// "59:55.25" of minutes, "1 days 00:00:00.25" or "0.25 sec". False for any other text.
bool ParseDateTime(std::string_view text, TimeNs* time);

}  // namespace trueline
