// A CSV file of unknown columns, for a list of what is in it.
#pragma once

#include <filesystem>
#include <memory>
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
struct CsvLayout : CsvDialect {
  std::vector<std::string> columns;
  std::vector<std::string> units;  // of the columns, without brackets; empty if no line states them
  bool has_made_names = false;  // by several lines of the head, or by a known layout without names
  std::optional<TimeColumns> time;
  std::string time_problem;  // empty, or why a column that is named as a time is not one
  std::string warning;       // empty, or why the names are not used
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

// Logs of lines of numbers: ASL (EuRoC) folders and TUM trajectories.

// Channels are the sensors, each a folder with data.csv, of `path` or `path`/mav0.
void WalkAsl(const std::filesystem::path& path, MessageSink* sink);
bool IsAsl(const std::filesystem::path& folder);

// The channel `trajectory`: t, tx, ty, tz, qx, qy, qz, qw.
void WalkTum(const std::filesystem::path& path, MessageSink* sink);

// Whether the first lines, comments apart, have 8 numbers with blanks between, of which the first
// rises and the last four are quaternions of norm 1; one row in ten may be damaged.
bool IsTum(std::string_view start);
// Whether they have 12 numbers, of which nine are rotations.
bool IsKitti(std::string_view start);
// Why a text with as many numbers a line is neither; empty for any other text.
std::string WhyNoTrajectory(const std::filesystem::path& path);

// Tables of text that converters write of recordings: one file or several, each with the columns of
// one topic or of several.

inline constexpr char kTablesFormat[] = "tables";

// The tables as a recording of the format that their names are of (ulog2csv, PlotJuggler: "ulog" or
// "ros2"; mavlogdump: "dataflash"; Blackbox Explorer and blackbox_decode: "blackbox"; cfclient:
// "crazyflie"), so that the map of that format reads them; else of the format "tables", with a
// channel for each file or topic.
std::unique_ptr<Recording> OpenTables(const std::vector<std::string>& files);

// What a recording of several files is named by; SplitPaths() gives them back.
std::string JoinPaths(const std::vector<std::string>& files);

// `files`, with those of a folder in its place where it holds tables.
std::vector<std::string> TablesIn(const std::vector<std::string>& files);

}  // namespace trueline
