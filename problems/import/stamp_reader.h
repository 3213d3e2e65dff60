// Times of foreign rows.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "problems/import/import_map.h"
#include "problems/import/wrapped_clock.h"
#include "problems/log/csv_text.h"

namespace trueline {

inline constexpr double kLatestSeconds = 9e9;  // of a stamp: 64 bits hold 292 years of nanoseconds

// The stamp of a row, in native time.
class StampReader {
 public:
  StampReader(const TimeSource& time, const std::string& file) : time_(time) {
    const auto found = std::find_if(time.offset_by_file.begin(), time.offset_by_file.end(),
                                    [&](const auto& entry) { return Fits(entry.first, file); });
    if (found != time.offset_by_file.end()) offset_ = FromSeconds(found->second);
  }

  void Bind(const ForeignRow& row) {
    if (!time_.of_row) time_.column.Bind(row);
  }

  TimeNs Read(const ForeignRow& row) {
    if (time_.of_row) return Shifted(row, row.Stamp());
    const int column = time_.column.index();
    if (!time_.factor) return Shifted(row, row.Time(column, time_.exponent));
    const double count = row.Number(column);
    if (!std::isfinite(count)) row.Fail(column, "the time stamp is missing; every row needs one");
    const double seconds = count * *time_.factor;
    if (!(std::abs(seconds) < kLatestSeconds)) FailBeyond(row, seconds);
    return Shifted(row, FromSeconds(seconds));
  }

  [[noreturn]] void FailUnsorted(const ForeignRow& row, TimeNs previous, TimeNs now) const {
    row.Fail(time_.column.index(),
             fmt::format("{} s does not come after {} s before; sort the rows, or set 'unsorted: "
                         "drop' in the map",
                         TimeText(now), TimeText(previous)));
  }

  // Of its wraps, which are undone; empty for none.
  std::string WrapText() const { return clock_.Text(); }

 private:
  TimeNs Shifted(const ForeignRow& row, TimeNs stamp) {
    stamp = clock_.Undo(stamp);
    const double seconds = ToSeconds(stamp) + ToSeconds(offset_);
    if (std::abs(seconds) < kLatestSeconds) return stamp + offset_;
    // A recording may have damaged stamps, which are left out by their distance from the others.
    if (time_.of_row) return stamp;
    FailBeyond(row, seconds);
  }
  [[noreturn]] void FailBeyond(const ForeignRow& row, double seconds) const {
    row.Fail(time_.column.index(),
             fmt::format("a time of {:.4g} s is beyond the {:.0e} s that a log can hold; correct "
                         "'unit', 'scale' or 'offset' of 'time' in the map",
                         seconds, kLatestSeconds));
  }

  TimeSource time_;
  TimeNs offset_ = 0;
  WrappedClock clock_;
};

}  // namespace trueline
