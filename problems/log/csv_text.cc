#include "problems/log/csv_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <limits>

namespace trueline {
namespace {

bool IsBlank(char c) { return c == ' ' || c == '\t'; }

// The end of a field: the next delimiter that stands in no quotes.
std::size_t FieldEnd(std::string_view line, std::size_t begin, char delimiter) {
  std::size_t at = begin;
  while (at < line.size() && IsBlank(line[at]) && line[at] != delimiter) ++at;
  if (at < line.size() && line[at] == '"') {
    const std::size_t close = line.find('"', at + 1);
    if (close != std::string_view::npos) begin = close;
  }
  return line.find(delimiter, begin);
}

// What writers put where there is no value.
bool MarksMissing(std::string_view text) {
  if (text.size() > 9 || text.find_first_of("0123456789") != std::string_view::npos) return false;
  if (text.find_first_not_of('-') == std::string_view::npos) return true;
  const std::string word = LowerCase(std::string(text));
  for (const char* mark :
       {"na", "n/a", "#n/a", "null", "none", "nil", "-nan", "-nan(ind)", "<na>"}) {
    if (word == mark) return true;
  }
  return false;
}
bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// digits * 10^exponent, as read: 1.25e3 is {125, 1}.
struct Decimal {
  bool negative = false;
  std::uint64_t digits = 0;
  int exponent = 0;
};

// Digits beyond 64 bits only change the exponent: they are far below a nanosecond.
void AppendDigit(char c, bool after_point, Decimal* decimal) {
  constexpr std::uint64_t kLimit = (std::numeric_limits<std::uint64_t>::max() - 9) / 10;
  if (decimal->digits > kLimit) {
    decimal->exponent += after_point ? 0 : 1;
    return;
  }
  decimal->digits = decimal->digits * 10 + static_cast<std::uint64_t>(c - '0');
  decimal->exponent -= after_point ? 1 : 0;
}

bool ParseExponent(std::string_view text, Decimal* decimal) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  int exponent = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), exponent);
  if (error != std::errc() || end != text.data() + text.size()) return false;
  if (exponent < -1000 || exponent > 1000) return false;
  decimal->exponent += exponent;
  return true;
}

bool ParseDecimal(std::string_view text, Decimal* decimal) {
  std::size_t i = 0;
  if (i < text.size() && (text[i] == '-' || text[i] == '+')) decimal->negative = text[i++] == '-';
  bool after_point = false;
  bool any = false;
  for (; i < text.size(); ++i) {
    if (IsDigit(text[i])) {
      AppendDigit(text[i], after_point, decimal);
      any = true;
    } else if (text[i] == '.' && !after_point) {
      after_point = true;
    } else {
      break;
    }
  }
  if (!any) return false;
  if (i == text.size()) return true;
  return (text[i] == 'e' || text[i] == 'E') && ParseExponent(text.substr(i + 1), decimal);
}

// Multiplies or divides by powers of ten, rounding to nearest. False on overflow.
bool Scale(int exponent, std::uint64_t* digits) {
  constexpr std::uint64_t kMax = std::numeric_limits<std::int64_t>::max();
  for (; exponent < -1 && *digits > 0; ++exponent) *digits /= 10;
  if (exponent < 0) *digits = (*digits + 5) / 10;
  for (; exponent > 0 && *digits > 0; --exponent) {
    if (*digits > kMax / 10) return false;
    *digits *= 10;
  }
  return *digits <= kMax;
}

}  // namespace

std::string_view TrimmedField(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && (IsBlank(text.back()) || text.back() == '\r')) text.remove_suffix(1);
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"') {
    text = text.substr(1, text.size() - 2);
  }
  return text;
}

void SplitFields(std::string_view line, char delimiter, std::vector<std::string_view>* fields) {
  fields->clear();
  if (delimiter == ' ') {
    for (std::size_t i = 0; i < line.size();) {
      while (i < line.size() && IsBlank(line[i])) ++i;
      const std::size_t begin = i;
      while (i < line.size() && !IsBlank(line[i])) ++i;
      if (i > begin) fields->push_back(TrimmedField(line.substr(begin, i - begin)));
    }
    return;
  }
  for (std::size_t begin = 0;;) {
    const std::size_t end = FieldEnd(line, begin, delimiter);
    fields->push_back(TrimmedField(line.substr(begin, end - begin)));
    if (end == std::string_view::npos) return;
    begin = end + 1;
  }
}

std::vector<HeaderColumn> SplitHeader(std::string_view line) {
  std::vector<std::string_view> fields;
  SplitFields(line, ',', &fields);
  std::vector<HeaderColumn> columns;
  for (const std::string_view field : fields) {
    const std::size_t open = field.find('['), close = field.rfind(']');
    HeaderColumn& column = columns.emplace_back(HeaderColumn{std::string(field)});
    column.name = TrimmedField(field.substr(0, open));
    if (open == std::string_view::npos || close == std::string_view::npos) continue;
    column.unit = TrimmedField(field.substr(open + 1, close - open - 1));
  }
  return columns;
}

void ValueSplitter::Split(std::string_view line, std::vector<std::string_view>* fields) {
  if (separators_.decimal_comma) {
    with_points_.assign(line);
    std::replace(with_points_.begin(), with_points_.end(), ',', '.');
    line = with_points_;
  }
  SplitFields(line, separators_.delimiter, fields);
  for (std::string_view& field : *fields) {
    if (MarksMissing(field)) field = {};
  }
}

bool ParseNumber(std::string_view text, double* value) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, *value);
  if (stop != end || text.empty()) return false;
  if (error == std::errc::result_out_of_range) {
    *value = 0.0;  // for a subnormal number; the return below rejects an overflow
    return text.find("e-") != std::string_view::npos || text.find("E-") != std::string_view::npos;
  }
  return error == std::errc();
}

namespace {

constexpr int kTicks = 2;
constexpr std::uint64_t kTicksTo1970 = 621355968000000000;  // of .NET, from the year 1 on

}  // namespace

bool ParseTime(std::string_view text, int exponent, TimeNs* time) {
  Decimal decimal;
  if (!ParseDecimal(text, &decimal)) return false;
  std::uint64_t digits = decimal.digits;
  if (exponent == kTicks && decimal.exponent == 0 && digits > kTicksTo1970) {
    digits -= kTicksTo1970;
  }
  if (!Scale(decimal.exponent + exponent, &digits)) return false;
  *time = decimal.negative ? -static_cast<TimeNs>(digits) : static_cast<TimeNs>(digits);
  return true;
}

std::string LowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string TimeText(TimeNs time) {
  const auto bits = static_cast<std::uint64_t>(time);
  const std::uint64_t magnitude = time < 0 ? 0 - bits : bits;
  return fmt::format("{}{}.{:09}", time < 0 ? "-" : "", magnitude / kNsPerSecond,
                     magnitude % kNsPerSecond);
}

}  // namespace trueline
