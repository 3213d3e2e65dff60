#include "problems/log/units.h"

#include <array>
#include <cctype>
#include <cmath>

#include "problems/common/units.h"
#include "problems/log/csv_text.h"

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
    {"rad/s", "mrad/s", 1e-3},
    {"rad/s", "rpm", kRpm},
    {"m/s", "cm/s", 1e-2},
    {"m/s", "mm/s", 1e-3},
    {"m/s^2", "g", kStandardGravity},
    {"m/s^2", "mg", 1e-3 * kStandardGravity},
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

namespace {

constexpr TimeNs kNsPerMinute = 60 * kNsPerSecond;
constexpr TimeNs kNsPerHour = 60 * kNsPerMinute;

// Reads the text from its start on.
class DateScanner {
 public:
  explicit DateScanner(std::string_view text) : left_(text) {}

  // A number of so many digits, within [low, high].
  bool Number(std::size_t digits, int low, int high, int* value) {
    if (left_.size() < digits) return false;
    *value = 0;
    for (const char c : left_.substr(0, digits)) {
      if (std::isdigit(static_cast<unsigned char>(c)) == 0) return false;
      *value = 10 * *value + (c - '0');
    }
    left_.remove_prefix(digits);
    return *value >= low && *value <= high;
  }
  // One of the characters.
  bool Skip(std::string_view any) {
    if (left_.empty() || any.find(left_.front()) == std::string_view::npos) return false;
    left_.remove_prefix(1);
    return true;
  }
  // The digits after a point or a comma, if there are any; to a nanosecond.
  TimeNs Fraction() {
    if (!Skip(".,")) return 0;
    TimeNs fraction = 0;
    TimeNs unit = kNsPerSecond;
    for (; !left_.empty() && std::isdigit(static_cast<unsigned char>(left_.front())) != 0;
         left_.remove_prefix(1)) {
      unit /= 10;
      fraction += unit * (left_.front() - '0');
    }
    return fraction;
  }
  bool AtEnd() const { return left_.empty(); }

 private:
  std::string_view left_;
};

bool ReadClock(DateScanner* scan, TimeNs* time) {
  int hour = 0, minute = 0, second = 0;
  if (!scan->Number(2, 0, 24, &hour) || !scan->Skip(":") || !scan->Number(2, 0, 59, &minute) ||
      !scan->Skip(":") || !scan->Number(2, 0, 60, &second)) {
    return false;
  }
  *time = hour * kNsPerHour + minute * kNsPerMinute + second * kNsPerSecond + scan->Fraction();
  return true;
}

// "Z", "+02:00", "+0200", "+02" or nothing; what is to be subtracted.
bool ReadZone(DateScanner* scan, TimeNs* zone) {
  *zone = 0;
  if (scan->AtEnd() || scan->Skip("Zz")) return true;
  const bool east = scan->Skip("+");
  if (!east && !scan->Skip("-")) return false;
  int hour = 0, minute = 0;
  if (!scan->Number(2, 0, 24, &hour)) return false;
  scan->Skip(":");
  if (!scan->AtEnd() && !scan->Number(2, 0, 59, &minute)) return false;
  *zone = (east ? 1 : -1) * (hour * kNsPerHour + minute * kNsPerMinute);
  return true;
}

}  // namespace

bool ParseDateTime(std::string_view text, TimeNs* time) {
  text = TrimmedField(text);
  constexpr std::string_view kDuration = " sec";  // of MATLAB's durations
  if (text.ends_with(kDuration)) {
    return ParseTime(text.substr(0, text.size() - kDuration.size()), 9, time);
  }
  DateScanner scan(text);
  TimeNs clock = 0, zone = 0;
  if (text.size() > 2 && text[2] == ':') {
    if (!ReadClock(&scan, &clock) || !scan.AtEnd()) return false;
    *time = clock;
    return true;
  }
  int year = 0, month = 0, day = 0;
  const bool is_date = scan.Number(4, 1900, 2200, &year) && scan.Skip("-/") &&
                       scan.Number(2, 1, 12, &month) && scan.Skip("-/") &&
                       scan.Number(2, 1, 31, &day) && scan.Skip("Tt ");
  if (!is_date || !ReadClock(&scan, &clock) || !ReadZone(&scan, &zone) || !scan.AtEnd()) {
    return false;
  }
  const std::chrono::sys_days date = std::chrono::year(year) /
                                     std::chrono::month(static_cast<unsigned>(month)) /
                                     std::chrono::day(static_cast<unsigned>(day));
  *time = std::chrono::nanoseconds(date.time_since_epoch()).count() + clock - zone;
  return true;
}

}  // namespace trueline
