// The text of a CSV field: splitting, numbers, and time stamps without loss.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "problems/common/time.h"

namespace trueline {

std::string_view TrimmedField(std::string_view text);  // without blanks and one pair of quotes

// The fields of one line. With a `delimiter` of ' ' a run of blanks and tabs counts as one.
void SplitFields(std::string_view line, char delimiter, std::vector<std::string_view>* fields);

// The line with decimal points, in `buffer`, where it is written with a decimal comma; else the
// line itself. Such a line is delimited by something else.
std::string_view WithDecimalPoints(std::string_view line, bool decimal_comma, std::string* buffer);

// A decimal number in full ("nan" and "inf" parse too). False when `text` is something else.
bool ParseNumber(std::string_view text, double* value);

// A decimal time to whole nanoseconds, rounded to nearest, without passing through a double.
// `exponent` is that of the unit in nanoseconds: 9 for s, 6 for ms, 3 for us, 0 for ns. False when
// `text` is no finite decimal number or does not fit 64 bits.
bool ParseTime(std::string_view text, int exponent, TimeNs* time);

// The time in seconds with nine decimals, exact.
std::string TimeText(TimeNs time);

}  // namespace trueline
