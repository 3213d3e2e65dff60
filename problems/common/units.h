// Units of files and flags in those of the program (SI).
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

namespace trueline {

inline constexpr double kDegree = M_PI / 180.0;      // rad
inline constexpr double kRpm = M_PI / 30.0;          // rad/s
inline constexpr double kFoot = 0.3048;              // m
inline constexpr double kStandardGravity = 9.80665;  // m/s^2, by definition of the unit g

// Time stamps: a 64-bit count of nanoseconds from any origin.
using TimeNs = std::int64_t;

inline constexpr TimeNs kNsPerSecond = 1'000'000'000;

// Seconds between two stamps; exact to a nanosecond for spans below 100 days.
inline double SecondsBetween(TimeNs from, TimeNs to) {
  return static_cast<double>(to - from) * 1e-9;
}

inline double ToSeconds(TimeNs t) { return static_cast<double>(t) * 1e-9; }

inline TimeNs FromSeconds(double seconds) {
  return static_cast<TimeNs>(std::llround(seconds * 1e9));
}

// Seconds of a steady clock.
inline double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace trueline
