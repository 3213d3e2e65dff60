#include "problems/import/formats/csv_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/import/formats/text_tables.h"
#include "problems/log/csv_text.h"
#include "problems/log/date_time.h"
#include "problems/log/line_reader.h"
#include "problems/log/units.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr std::size_t kSampleRows = 200;  // that show the time column and its unit

class CsvRowDecoder : public MessageDecoder {
 public:
  explicit CsvRowDecoder(const CsvLayout& layout) : separators_(layout.separators) {
    for (std::size_t i = 0; i < layout.columns.size(); ++i) {
      fields_.push_back({layout.columns[i], layout.units.empty() ? "" : layout.units[i]});
    }
  }

  bool Describe(std::string_view, Channel* channel) override {
    channel->fields = fields_;
    return true;
  }
  bool Decode(std::string_view message, std::vector<Cell>* cells) const override {
    std::vector<std::string_view> texts;
    ValueSplitter splitter(separators_);
    splitter.Split(message, &texts);
    if (texts.size() != cells->size()) return false;
    ParseCells(texts, 0, cells);
    return true;
  }

 private:
  std::vector<ChannelField> fields_;
  CsvSeparators separators_;
};

std::vector<std::string> Split(std::string_view line, const CsvSeparators& separators) {
  std::vector<std::string_view> texts;
  ValueSplitter splitter(separators);
  splitter.Split(line, &texts);
  return {texts.begin(), texts.end()};
}

bool AreNumbers(const std::vector<std::string>& texts) {
  double value = 0.0;
  return std::all_of(texts.begin(), texts.end(),
                     [&value](const std::string& text) { return ParseNumber(text, &value); });
}

// Blanks separate only where nothing else does: names and values may have blanks beside commas.
char DelimiterOf(std::string_view line) {
  const auto count = [line](char c) { return std::count(line.begin(), line.end(), c); };
  char best = ',';
  for (const char candidate : {';', '\t', '|'}) {
    if (count(candidate) > count(best)) best = candidate;
  }
  return count(best) > 0 ? best : ' ';
}

std::size_t CountNumbers(const std::vector<std::string>& texts) {
  double value = 0.0;
  const auto count = std::count_if(texts.begin(), texts.end(), [&value](const std::string& text) {
    return ParseNumber(text, &value);
  });
  return static_cast<std::size_t>(count);
}

// Commas are decimal where most fields are numbers once they are points, and fewer before.
CsvSeparators SeparatorsOf(std::string_view line) {
  for (const char delimiter : {';', '\t', '|'}) {
    if (line.find(delimiter) == std::string_view::npos) continue;
    const CsvSeparators separators{delimiter, true};
    const std::vector<std::string> with_points = Split(line, separators);
    const std::size_t numbers = CountNumbers(with_points);
    const bool are_most = 2 * numbers > with_points.size();
    if (are_most && CountNumbers(Split(line, {delimiter, false})) < numbers) return separators;
  }
  return {DelimiterOf(line), false};
}

// A line that starts with '#' and that no row of numbers follows. "# t,x,y" before rows has names.
bool IsComment(std::string_view line, std::string_view next) {
  if (!line.starts_with('#')) return false;
  double number = 0.0;
  return next.starts_with('#') || !ParseNumber(Split(next, SeparatorsOf(next)).front(), &number);
}

// The line of names and rows, or rows.
struct FirstLines {
  int skipped = 0;  // lines before them
  std::vector<std::string> lines;
};

FirstLines ReadFirstLines(const std::filesystem::path& path) {
  LineReader lines(path);
  FirstLines first;
  std::string_view line;
  while (first.lines.size() <= kSampleRows && lines.NextFilled(&line)) {
    if (first.lines.size() == 1 && IsComment(first.lines.front(), line)) first.lines.clear();
    if (first.lines.empty()) first.skipped = lines.line_number() - 1;
    first.lines.emplace_back(line);
  }
  if (first.lines.empty()) {
    throw ErrorAt(path.string(), 0, "has no line with text; copy the log again");
  }
  return first;
}

// A time column's name starts or ends with one of these, after marks as in "# time" and "%time".
bool IsTimeName(const std::string& column) {
  std::string name = LowerCase(column);
  name.erase(0, std::min(name.find_first_not_of("#%*_/ "), name.size()));
  const std::string bare =
      std::string(TrimmedField(std::string_view(name).substr(0, name.find_first_of("[("))));
  for (const char* word : {"time", "timestamp", "stamp"}) {
    if (name.starts_with(word) || bare.ends_with(word)) return true;
  }
  for (const char* end : {"time_s", "time_ms", "time_us", "time_ns"}) {
    if (bare.ends_with(end)) return true;
  }
  // "t", "t_s", "t [ms]", but not "theta".
  return name.starts_with('t') &&
         (name.size() == 1 || std::isalpha(static_cast<unsigned char>(name[1])) == 0);
}

// The numbers of a column, in s of dates; empty if one is neither.
std::vector<double> ColumnOf(const std::vector<std::vector<std::string>>& rows,
                             std::size_t column) {
  std::vector<double> values;
  for (const std::vector<std::string>& row : rows) {
    if (column >= row.size()) return {};
    double value = 0.0;
    TimeNs date = 0;
    const bool is_number = ParseNumber(row[column], &value);
    if (!is_number && !ParseDateTime(row[column], &date)) return {};
    values.push_back(is_number ? value : ToSeconds(date));
  }
  return values;
}

bool Rises(const std::vector<double>& values) {
  const auto not_after = [](double a, double b) { return !(b > a); };
  return values.size() > 1 &&
         std::adjacent_find(values.begin(), values.end(), not_after) == values.end();
}

bool Increases(const std::vector<double>& values) {
  return !values.empty() && std::is_sorted(values.begin(), values.end()) &&
         (values.size() == 1 || values.back() > values.front());
}

// Of the columns' steps; repeated stamps have none.
double MedianRise(const std::vector<double>& values) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] > values[i - 1]) steps.push_back(values[i] - values[i - 1]);
  }
  return steps.empty() ? 0.0 : UpperMedian(steps);
}

// A stamp since 1970 in a unit whose name is not known, by its size.
int ExponentBySize(double size) { return size > 1e17 ? 0 : size > 1e14 ? 3 : size > 1e11 ? 6 : 9; }

// Whether rows at such a step are those of a log.
bool IsStepOfLog(double step, int exponent) {
  const double seconds = step * std::pow(10.0, exponent - 9);
  return seconds > 2e-5 && seconds < 1.5;
}

// By the name, else by the size of a stamp since 1970 if the step between rows fits that, else by
// the step: logs have 20 Hz to 20 kHz.
int TimeExponent(const std::string& column, const std::string& stated,
                 const std::vector<double>& values) {
  const std::string name = LowerCase(column);
  const auto says = [&](const char* unit) {
    const std::string end = unit;
    return stated == end || name.ends_with("_" + end) || name.ends_with("[" + end + "]") ||
           name.ends_with("(" + end + ")");
  };
  if (says("ns")) return 0;
  if (says("us")) return 3;
  if (says("ms")) return 6;
  if (says("s")) return 9;
  const double step = MedianRise(values);
  const int by_size = ExponentBySize(std::abs(values.front()));
  if (by_size < 9 && (step == 0.0 || IsStepOfLog(step, by_size))) return by_size;
  if (step > 6e4) return 0;
  if (step > 50.0) return 3;
  return step >= 1.0 ? 6 : 9;
}

// True if a column is taken as the time.
template <class Fits>
bool FindTime(const std::vector<std::vector<std::string>>& rows, const Fits& fits,
              CsvLayout* layout) {
  for (std::size_t i = 0; i < layout->columns.size(); ++i) {
    const std::vector<double> values = ColumnOf(rows, i);
    if (!fits(layout->columns[i], values)) continue;
    layout->time_column = i;
    layout->time_exponent = TimeExponent(
        layout->columns[i], layout->units.empty() ? "" : LowerCase(layout->units[i]), values);
    return true;
  }
  return false;
}

void FindTime(const std::vector<std::vector<std::string>>& rows, CsvLayout* layout) {
  layout->is_time_named = FindTime(
      rows,
      [](const std::string& name, const auto& values) {
        return IsTimeName(name) && Increases(values);
      },
      layout);
  if (layout->is_time_named) return;
  FindTime(
      rows, [](const std::string&, const auto& values) { return Rises(values); }, layout);
}

// "m/s^2", "[rad/s]" or "(s)" without its brackets.
std::string UnitText(const std::string& text) {
  const bool bracketed = text.size() > 1 && (text.front() == '[' || text.front() == '(');
  return bracketed ? text.substr(1, text.size() - 2) : text;
}

// A line of units: each is known, in brackets, or none.
bool IsUnitsLine(const std::vector<std::string>& texts) {
  const auto is_unit = [](const std::string& text) {
    const std::string unit = UnitText(text);
    if (unit != text || unit.empty() || unit == "1" || unit == "-") return true;
    for (const char* si : {"s", "m", "m/s^2", "rad", "rad/s", "V"}) {
      if (UnitFactor(si, unit)) return true;
    }
    return false;
  };
  const auto has_letter = [](const std::string& text) {
    return std::any_of(text.begin(), text.end(), [](unsigned char c) { return std::isalpha(c); });
  };
  return std::any_of(texts.begin(), texts.end(), has_letter) &&
         std::all_of(texts.begin(), texts.end(), is_unit);
}

// The names of the first line, or numbers.
void NameColumns(const std::vector<std::string>& first, std::size_t width, CsvLayout* layout) {
  layout->header = !AreNumbers(first);
  if (layout->header && first.size() == width) {
    layout->columns = first;
    return;
  }
  if (layout->header) {
    layout->warning = fmt::format(
        "the first line names {} columns where the rows have {}; which names are whose is not "
        "known, so that columns go by number",
        first.size(), width);
  }
  for (std::size_t i = 1; i <= width; ++i) layout->columns.push_back(std::to_string(i));
}

// The line after names and units that shows how numbers are written.
const std::string& FirstRow(const std::vector<std::string>& lines) {
  if (lines.size() < 2) return lines.front();
  const bool units = IsUnitsLine(Split(lines[1], SeparatorsOf(lines[1])));
  return lines.size() > 2 && units ? lines[2] : lines[1];
}

}  // namespace

CsvLayout GuessCsvLayout(const std::filesystem::path& path) {
  const auto [skipped, lines] = ReadFirstLines(path);
  CsvLayout layout;
  layout.skip_lines = skipped;
  layout.separators = SeparatorsOf(FirstRow(lines));
  auto first = Split(lines.front(), layout.separators);
  if (!AreNumbers(first)) first = Split(lines.front(), {layout.separators.delimiter, false});
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 1; i < lines.size(); ++i) rows.push_back(Split(lines[i], layout.separators));
  layout.units_line = rows.size() > 1 && !AreNumbers(first) && IsUnitsLine(rows.front());
  if (layout.units_line) {
    for (const std::string& text : rows.front()) layout.units.push_back(UnitText(text));
    rows.erase(rows.begin());
  }
  NameColumns(first, rows.empty() ? first.size() : rows.front().size(), &layout);
  layout.units.resize(layout.units_line ? layout.columns.size() : 0);
  if (rows.size() > 1) rows.pop_back();  // the last line may be cut off
  FindTime(rows, &layout);
  return layout;
}

void WalkCsv(const std::filesystem::path& path, MessageSink* sink) {
  const CsvLayout layout = GuessCsvLayout(path);
  const std::string unknown = WhyNoTrajectory(path);
  for (const std::string& warning : {layout.warning, unknown}) {
    if (!warning.empty()) sink->Warn(warning);
  }
  const std::size_t channel =
      sink->AddChannel({"rows", 0, ""}, [&] { return std::make_unique<CsvRowDecoder>(layout); });
  LineReader lines(path);
  std::string_view line;
  const int before = layout.skip_lines + (layout.header ? 1 : 0) + (layout.units_line ? 1 : 0);
  for (int i = 0; i < before; ++i) lines.Next(&line);
  ValueSplitter splitter(layout.separators);
  std::vector<std::string_view> texts;
  while (lines.NextFilled(&line)) {
    TimeNs time = 0;
    if (layout.time_column) {
      splitter.Split(line, &texts);
      if (*layout.time_column < texts.size()) {
        const std::string_view text = texts[*layout.time_column];
        if (!ParseTime(text, layout.time_exponent, &time)) ParseDateTime(text, &time);
      }
    }
    sink->Add(channel, time, line);
  }
}

}  // namespace trueline
