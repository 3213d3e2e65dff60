// A CSV file of unknown columns, for a list of what is in it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "problems/import/formats/recording.h"
#include "problems/log/csv_text.h"

namespace trueline {

inline constexpr int kTicksExponent = 2;  // of .NET; from the year 1 on, as ParseTime() knows

// Where a row's time stands.
struct TimeColumns {
  std::size_t column = 0;
  int exponent = 9;                          // of its unit, for ParseTime(): 9 for s, 6 for ms, ...
  std::optional<std::size_t> nanoseconds{};  // in a column of their own, beside seconds
  double step = 0.0;                         // median from row to row, in its unit
  double frame = 0.0;                        // s, of a count of frames from 1 on; 0: it is a time
  bool is_named = false, is_stated = false;  // by its name; its unit, too

  // False, and `time` as it was, where a row has none.
  bool Read(const std::vector<std::string_view>& texts, TimeNs* time) const;
};

// What the first lines of a CSV file show. A column without a name has its number from 1 as its
// name. Names are ignored where there are more or fewer than columns.
struct CsvLayout {
  CsvSeparators separators;
  int skip_lines = 0;       // comments and other lines of a head, before names or rows
  bool header = true;       // a line of names follows
  bool units_line = false;  // and below that one of units, as "s,m/s^2"
  std::vector<std::string> columns;
  std::vector<std::string> units;  // of the columns, without brackets; empty if no line states them
  bool has_made_names = false;  // by several lines of the head, or by a known layout without names
  std::optional<TimeColumns> time;
  std::string time_problem;  // empty, or why a column that is named as a time is not one
  std::string warning;       // empty, or why the names are not used

  int LinesBeforeRows() const { return skip_lines + (header ? 1 : 0) + (units_line ? 1 : 0); }
};

// Of the columns of `which`: the stamp of measurement before those of arrival; by the names, if
// values increase, else the first column whose values do and that counts no rows. `problem` becomes
// why there is none.
std::optional<TimeColumns> FindTimeColumns(const CsvLayout& layout,
                                           const std::vector<std::size_t>& which,
                                           const std::vector<std::vector<std::string>>& rows,
                                           bool may_be_unnamed, std::string* problem = nullptr);

bool IsValue(const std::string& text);  // a number, or a date or time of day

// Throws InputError for a file without text.
CsvLayout GuessCsvLayout(const std::filesystem::path& path);

struct TableColumn {
  std::size_t index;
  std::string name;  // of the field
  std::string unit;
  double scale = 1.0, shift = 0.0;
  std::optional<int> time_exponent = {};  // of its unit: it is the stamp, exact to a nanosecond
};

// Numbers of some columns of a row that has `width` of them.
class TableDecoder : public MessageDecoder {
 public:
  TableDecoder(std::vector<TableColumn> columns, const CsvSeparators& separators, std::size_t width)
      : columns_(std::move(columns)), separators_(separators), width_(width) {}

  bool Describe(std::string_view, Channel* channel) override;
  bool Decode(std::string_view message, std::vector<Cell>* cells) const override;

 private:
  std::vector<TableColumn> columns_;
  CsvSeparators separators_;
  std::size_t width_;
};

// The channel `rows`; records have time 0 where no time column is found.
void WalkCsv(const std::filesystem::path& path, MessageSink* sink);

}  // namespace trueline
