#include "problems/log/units.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <utility>

#include "problems/common/units.h"
#include "problems/log/csv_text.h"

namespace trueline {
namespace {

struct Unit {
  std::string_view si, name;
  double factor;
};

// Every SI unit converts to itself, whether it is here or not.
constexpr auto kUnits = std::to_array<Unit>({
    {"1", "%", 1e-2},
    {"s", "ms", 1e-3},
    {"s", "us", 1e-6},
    {"s", "ns", 1e-9},
    {"s", "ticks", 1e-7},
    {"m", "cm", 1e-2},
    {"m", "mm", 1e-3},
    {"m", "ft", kFoot},
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
    if (!StartsWithOneOf(any)) return false;
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
  // A word in capitals, after blanks or none.
  bool Word(std::string_view word) {
    const std::string_view text =
        left_.substr(std::min(left_.find_first_not_of(' '), left_.size()));
    if (!text.starts_with(word) && !text.starts_with(LowerCase(std::string(word)))) return false;
    left_ = text.substr(word.size());
    return true;
  }
  bool StartsWithOneOf(std::string_view any) const {
    return !left_.empty() && any.find(left_.front()) != std::string_view::npos;
  }
  bool AtEnd() const { return left_.empty(); }

 private:
  std::string_view left_;
};

// "13:00:25.5", also of twelve hours; "00:25.5" is in minutes if it has a fraction.
bool ReadClock(DateScanner* scan, TimeNs* time) {
  int hour = 0, minute = 0, second = 0;
  if (!scan->Number(2, 0, 60, &hour) || !scan->Skip(":") || !scan->Number(2, 0, 60, &minute)) {
    return false;
  }
  if (!scan->Skip(":")) {
    if (!scan->StartsWithOneOf(".,")) return false;
    *time = hour * kNsPerMinute + minute * kNsPerSecond + scan->Fraction();
    return true;
  }
  if (!scan->Number(2, 0, 60, &second)) return false;
  const TimeNs fraction = scan->Fraction();
  const bool afternoon = scan->Word("PM");
  if (afternoon || scan->Word("AM")) hour = hour % 12 + (afternoon ? 12 : 0);
  *time = hour * kNsPerHour + minute * kNsPerMinute + second * kNsPerSecond + fraction;
  return hour <= 24 && minute < 60;
}

// 2024-05-20, 05/20/2024 or 20.05.2024. The order of day and month of a flight within one day does
// not matter.
bool ReadDate(DateScanner* scan, std::chrono::sys_days* date) {
  int year = 0, month = 0, day = 0;
  DateScanner other = *scan;
  if (scan->Number(4, 1900, 2200, &year)) {
    if (!scan->Skip("-/") || !scan->Number(2, 1, 12, &month) || !scan->Skip("-/") ||
        !scan->Number(2, 1, 31, &day)) {
      return false;
    }
  } else {
    *scan = other;
    if (!scan->Number(2, 1, 31, &month) || !scan->Skip("-/.") || !scan->Number(2, 1, 31, &day) ||
        !scan->Skip("-/.") || !scan->Number(4, 1900, 2200, &year)) {
      return false;
    }
    if (month > 12) std::swap(month, day);
  }
  if (month > 12) return false;
  *date = std::chrono::year(year) / std::chrono::month(static_cast<unsigned>(month)) /
          std::chrono::day(static_cast<unsigned>(day));
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
  TimeNs clock = 0, zone = 0, days = 0;
  constexpr std::string_view kDays = " days ";  // of durations of pandas
  if (const std::size_t at = text.find(kDays); at != std::string_view::npos) {
    if (!ParseTime(text.substr(0, at), 0, &days)) return false;
    text = text.substr(at + kDays.size());
  }
  DateScanner scan(text);
  if (text.size() > 2 && text[2] == ':') {
    if (!ReadClock(&scan, &clock) || !scan.AtEnd()) return false;
    *time = 24 * kNsPerHour * days + clock;
    return true;
  }
  std::chrono::sys_days date;
  if (!ReadDate(&scan, &date) || !scan.Skip("Tt ") || !ReadClock(&scan, &clock) ||
      !ReadZone(&scan, &zone) || !scan.AtEnd()) {
    return false;
  }
  *time = std::chrono::nanoseconds(date.time_since_epoch()).count() + clock - zone;
  return true;
}

}  // namespace trueline
