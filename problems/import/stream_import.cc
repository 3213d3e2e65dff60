#include "problems/import/stream_import.h"

#include <fmt/format.h>

#include <cmath>

#include "problems/log/csv_text.h"

namespace trueline {

StampReader::StampReader(const TimeSource& time, const std::string& file) : time_(time) {
  std::vector<std::string> patterns;
  for (const auto& [pattern, offset] : time.offset_by_file) patterns.push_back(pattern);
  const auto fitting = FirstFitting(patterns, file);
  for (const auto& [pattern, offset] : time.offset_by_file) {
    if (fitting && pattern == *fitting) offset_ = FromSeconds(offset);
  }
}

TimeNs StampReader::Read(const ForeignCsv& csv) const {
  const int column = time_.column.index();
  if (!time_.factor) return csv.Time(column, time_.exponent) + offset_;
  const double count = csv.Number(column);
  if (!std::isfinite(count)) csv.Fail(column, "the time stamp is missing; every row needs one");
  return FromSeconds(count * *time_.factor) + offset_;
}

void StampReader::FailUnsorted(const ForeignCsv& csv, TimeNs previous, TimeNs now) const {
  csv.Fail(time_.column.index(),
           fmt::format("{} s does not come after {} s before; sort the rows, or set 'unsorted: "
                       "drop' in the map",
                       TimeText(now), TimeText(previous)));
}

std::string LeftOut(const std::string& stream, std::size_t unsorted, std::size_t missing,
                    std::size_t out_of_range, std::size_t off_median) {
  std::string text;
  const auto add = [&](std::size_t count, const char* reason) {
    if (count == 0) return;
    text += fmt::format("{} {} {}", text.empty() ? "" : ",", count, reason);
  };
  add(unsorted, "that came too late");
  add(missing, "with missing values");
  add(out_of_range, "out of range");
  add(off_median, "far from the running median");
  return text.empty() ? text : fmt::format("{}: rows left out:{}", stream, text);
}

}  // namespace trueline
