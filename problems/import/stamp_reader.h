// Times of foreign rows.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "problems/common/units.h"
#include "problems/import/import_map.h"
#include "problems/log/csv_text.h"

namespace trueline {

// Where the clock of a recording steps back, as after a restart of the logger.

// Rows whose time goes on without a jump.
struct ClockRun {
  TimeNs from = 0, to = 0;
  std::size_t count = 0;
};

// Rows in the order of the file between two steps back.
struct ClockPart {
  std::size_t begin = 0, end = 0;   // places in the file (ForeignRow::Place())
  std::size_t count = 0;            // rows
  TimeNs from = 0, to = 0;          // the middle of its first and of its last rows
  std::vector<ClockRun> runs = {};  // of several rows; a part may lack times that another has
};

// `stamps` in the order of the file, and their places there. A part for each time between steps.
std::vector<ClockPart> PartsByClock(const std::vector<TimeNs>& stamps,
                                    const std::vector<std::size_t>& places);
// Whether parts have the same times, by more than rows out of order explain.
bool AnyOverlap(const std::vector<ClockPart>& parts);

// s, the sum of the gaps between stamps, of which one longer than 2 s counts for no more.
double CoveredBy(std::vector<TimeNs> stamps);

// Counters of 16 or 32 bits that start again from zero while a log goes on.
class WrappedClock {
 public:
  // The time that `stamp` means, after those given before. A step back is a wrap where the counter
  // was near its end and is near zero; a restart at another time is none.
  TimeNs Undo(TimeNs stamp);

  // "the counter of 32 bits in us wraps once, after 4294.966 s"; empty where it does not.
  std::string Text() const;

 private:
  std::size_t count_ = 0;
  TimeNs first_ = 0, last_ = 0;  // last_: with the wraps undone
  TimeNs period_ = 0;            // of the counter; 0 before it has wrapped
  TimeNs wrapped_at_ = 0;
  std::int64_t epoch_ = 0, most_ = 0;
  const char* counter_ = "";
};

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
                         "sort' in the map, which keeps the longest part of a clock that restarts",
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
