// A CSV file of unknown columns, for a list of what is in it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/import/formats/recording.h"
#include "problems/log/csv_text.h"

namespace trueline {

// What the first lines of a CSV file show. A column without a name has its number from 1 as its
// name. Names are ignored where there are more or fewer than columns.
struct CsvLayout {
  CsvSeparators separators;
  int skip_lines = 0;       // comments, which start with '#', and blank lines before names or rows
  bool header = true;       // a line of names follows
  bool units_line = false;  // and below that one of units, as "s,m/s^2"
  std::vector<std::string> columns;
  std::vector<std::string> units;  // of the columns, without brackets; empty if no line states them
  // By its name, if its values increase; else the first column whose values do.
  std::optional<std::size_t> time_column;
  bool is_time_named = false;
  int time_exponent = 9;  // of its unit, for ParseTime(): 9 for s, 6 for ms, ...
  std::string warning;    // empty, or why the names are not used
};

// Throws InputError for a file without text.
CsvLayout GuessCsvLayout(const std::filesystem::path& path);

// The channel `rows`; records have time 0 where no time column is found.
void WalkCsv(const std::filesystem::path& path, MessageSink* sink);

}  // namespace trueline
