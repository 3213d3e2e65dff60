#include "problems/import/formats/csv_table.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "problems/common/error.h"
#include "problems/import/formats/bytes.h"
#include "problems/log/text_file.h"
#include "problems/log/units.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr std::size_t kSampleRows = 1000;  // that show the head, the time column and its unit

std::vector<std::string> Split(std::string_view line, const CsvSeparators& separators) {
  std::vector<std::string_view> texts;
  ValueSplitter splitter(separators);
  splitter.Split(line, &texts);
  return {texts.begin(), texts.end()};
}

bool IsNumber(const std::string& text) {
  double value = 0.0;
  return ParseNumber(text, &value);
}

std::size_t Count(const std::vector<std::string>& texts, bool (*is)(const std::string&)) {
  return static_cast<std::size_t>(std::count_if(texts.begin(), texts.end(), is));
}

// Whether a line names the columns of a row: it has text where the row has values, or hardly a
// value. A row may hold text, too.
bool AreNames(const std::vector<std::string>& texts, const std::vector<std::string>& row) {
  const std::size_t values = Count(texts, IsValue);
  bool names = false, any_text = false;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const bool is_text = !texts[i].empty() && !IsValue(texts[i]);
    any_text = any_text || is_text;
    names = names || (is_text && i < row.size() && IsValue(row[i]));
  }
  return any_text && (names || texts.size() != row.size() || 2 * values <= texts.size());
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

// Commas are decimal where most fields are numbers once they are points, and fewer before.
CsvSeparators SeparatorsOf(std::string_view line) {
  for (const char delimiter : {';', '\t', '|'}) {
    if (line.find(delimiter) == std::string_view::npos) continue;
    const CsvSeparators separators{delimiter, true};
    const std::vector<std::string> with_points = Split(line, separators);
    const std::size_t numbers = Count(with_points, IsNumber);
    const bool are_most = 2 * numbers > with_points.size();
    if (are_most && Count(Split(line, {delimiter, false}), IsNumber) < numbers) return separators;
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
  std::vector<std::string> lines;
  std::vector<int> numbers;  // of the lines in the file, from 1
};

FirstLines ReadFirstLines(const std::filesystem::path& path) {
  LineReader lines(path);
  FirstLines first;
  std::string_view line;
  while (first.lines.size() <= kSampleRows && lines.NextFilled(&line)) {
    if (first.lines.size() == 1 && IsComment(first.lines.front(), line)) first = {};
    first.lines.emplace_back(line);
    first.numbers.push_back(lines.line_number());
  }
  if (first.lines.empty()) {
    throw ErrorAt(path.string(), 0, "has no line with text; copy the log again");
  }
  return first;
}

// "m/s^2", "[rad/s]" or "(s)" without its brackets.
std::string UnitText(const std::string& text) {
  const bool bracketed = text.size() > 1 && (text.front() == '[' || text.front() == '(');
  return bracketed ? text.substr(1, text.size() - 2) : text;
}

// A line of units or types below the names: text, but for the unit 1.
bool IsUnitsLine(const std::vector<std::string>& texts) {
  const auto is_text = [](const std::string& t) { return !t.empty() && !IsValue(t); };
  return std::any_of(texts.begin(), texts.end(), is_text) &&
         std::all_of(texts.begin(), texts.end(),
                     [&](const std::string& t) { return t.empty() || t == "1" || is_text(t); });
}

// The names of the first line, or numbers.
void NameColumns(const std::vector<std::string>& first, std::size_t width, CsvLayout* layout) {
  if (layout->header && first.size() == width) {
    layout->columns = first;
    for (std::size_t i = 0; i < width; ++i) {
      if (first[i].empty()) layout->columns[i] = std::to_string(i + 1);
    }
    return;
  }
  if (layout->header) {
    layout->warning = fmt::format(
        "the first line names {} columns where the rows have {}; which name belongs to which "
        "column is unknown, so columns go by number",
        first.size(), width);
  }
  for (std::size_t i = 1; i <= width; ++i) layout->columns.push_back(std::to_string(i));
}

// Rows of numbers without names that have a well-known layout.
std::vector<std::string> NamesByShape(const std::vector<std::vector<std::string>>& rows) {
  std::size_t width = rows.empty() ? 0 : rows.front().size();
  if (width > 1 && rows.front().back().empty()) --width;  // a comma ends the lines
  const auto median_norm = [&](std::size_t from, std::size_t count) {
    std::vector<double> norms;
    for (const auto& row : rows) {
      double sum = 0.0, value = 0.0;
      for (std::size_t i = from; i < from + count && i < row.size(); ++i) {
        if (ParseNumber(row[i], &value)) sum += value * value;
      }
      norms.push_back(std::sqrt(sum));
    }
    return UpperMedian(norms);
  };
  if (width < 7) return {};
  const bool is_pose = width >= 8 && std::abs(median_norm(4, 4) - 1.0) < 0.03;
  std::vector<std::string> names;
  if (is_pose && width == 8) names = {"t", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};
  if (is_pose && width >= 11)
    names = {"t", "px", "py", "pz", "qw", "qx", "qy", "qz", "vx", "vy", "vz"};
  if (width == 7) {
    constexpr double kLeast = 6.0, kMost = 20.0;  // m/s^2
    const double first = median_norm(1, 3), second = median_norm(4, 3);
    const bool gyro_first = second > kLeast && second < kMost && first < kLeast;
    if (gyro_first) names = {"t", "gx", "gy", "gz", "ax", "ay", "az"};
    if (first > kLeast && first < kMost && second < kLeast) {
      names = {"t", "ax", "ay", "az", "gx", "gy", "gz"};
    }
  }
  if (names.empty()) return {};
  while (names.size() < rows.front().size()) names.push_back(std::to_string(names.size() + 1));
  return names;
}

// A line after names and units that shows how numbers are written: no comment, nor names again.
const std::string& RowOf(const std::vector<std::string>& lines) {
  if (lines.size() < 4) return lines.back();
  const auto middle = lines.begin() + static_cast<std::ptrdiff_t>(lines.size() / 2);
  const auto row = std::find_if(middle, lines.end(), [](const std::string& line) {
    return !line.starts_with('#') && Count(Split(line, SeparatorsOf(line)), IsNumber) > 0;
  });
  return row == lines.end() ? *middle : *row;
}

// Where the head of a table ends.
struct Head {
  std::size_t names = 0;                 // place of the line of names
  std::vector<std::string> joined = {};  // names of several lines, as of Motive and MultiIndex
};

bool AreUnique(std::vector<std::string> names) {
  std::erase(names, "");
  std::sort(names.begin(), names.end());
  return std::adjacent_find(names.begin(), names.end()) == names.end();
}

// The names of the last line, each after what the lines above say of its column, where that is not
// the same of all columns.
std::vector<std::string> Joined(const std::vector<std::vector<std::string>>& lines) {
  std::vector<std::string> joined(lines.back().size());
  for (const std::vector<std::string>& line : lines) {
    std::vector<std::string> texts = line;
    std::erase(texts, "");
    const bool differ = std::any_of(texts.begin(), texts.end(),
                                    [&](const std::string& t) { return t != texts.front(); });
    if (!differ && &line != &lines.back()) continue;
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (line[i].empty() || IsValue(line[i])) continue;
      joined[i] += (joined[i].empty() ? "" : ".") + line[i];
    }
  }
  return joined;
}

// Lines of a head that have other numbers of fields than the rows are skipped. Where names repeat,
// the lines above tell them apart.
Head HeadOf(const std::vector<std::string>& lines, const std::vector<std::string>& row,
            const CsvSeparators& separators) {
  std::vector<std::vector<std::string>> texts;  // lines of the rows' width before the first row
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < lines.size() / 2; ++i) {
    const std::vector<std::string> line = Split(lines[i], separators);
    if (line.size() != row.size()) continue;
    if (!AreNames(line, row)) {
      // Numbers of bodies, or a row with gaps.
      if (Count(line, IsValue) < Count(row, IsValue)) continue;
      break;
    }
    texts.push_back(Split(lines[i], {separators.delimiter, false}));
    places.push_back(i);
  }
  if (texts.empty()) return {};
  // Of a tracker's file a line above may name the body alone.
  const auto rank = [](const std::vector<std::string>& line) {
    return AreUnique(line) ? std::count(line.begin(), line.end(), "") : 1L << 30;
  };
  const auto unique = std::min_element(
      texts.begin(), texts.end(), [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  if (AreUnique(*unique)) return {places[static_cast<std::size_t>(unique - texts.begin())]};
  return {places.back(), texts.size() > 1 ? Joined(texts) : std::vector<std::string>()};
}

// Frames a second by the lines of a head: "FREQUENCY 100", "Capture rate,120", or a number alone as
// Vicon has it. 0 for none.
double RateStatedIn(std::vector<std::string> head) {
  double rate = 0.0;
  for (std::string& line : head) {
    std::replace_if(
        line.begin(), line.end(), [](char c) { return std::strchr(",;:=\t", c); }, ' ');
    const std::vector<std::string> words = Split(line, {' ', false});
    const std::string name = words.empty() ? "" : LowerCase(line) + " ";
    const bool says = name.find("rate ") != std::string::npos || name.starts_with("frequency ");
    double number = 0.0;
    if ((says || words.size() == 1) && ParseNumber(words.back(), &number) && number > 1.0) {
      rate = number;
    }
    if (says && rate > 0.0) break;
  }
  return rate;
}

namespace fs = std::filesystem;

// "w_RS_S_x [rad s^-1]"
TableColumn ParseAslColumn(std::size_t index, std::string_view text) {
  if (text.starts_with('#')) text.remove_prefix(1);
  const std::size_t unit = text.find(" [");
  TableColumn column{index, std::string(TrimmedField(text.substr(0, unit))), ""};
  if (unit != std::string_view::npos && text.ends_with(']')) {
    column.unit = text.substr(unit + 2, text.size() - unit - 3);
  }
  return column;
}

// Rows of numbers; the first column is the time.
void AddRows(LineReader* lines, const std::string& name, std::vector<TableColumn> columns,
             char delimiter, int time_exponent, MessageSink* sink) {
  columns.front().time_exponent = time_exponent;
  const std::size_t channel = sink->AddChannel({name, 0, ""}, [&] {
    return std::make_unique<TableDecoder>(columns, CsvSeparators{delimiter, false}, columns.size());
  });
  for (std::string_view line; lines->NextFilled(&line);) {
    if (line.starts_with('#')) continue;
    std::vector<std::string_view> texts;
    SplitFields(line, delimiter, &texts);
    TimeNs time = 0;
    if (!texts.empty()) ParseTime(texts[0], time_exponent, &time);
    sink->Add(channel, time, line);
  }
}

constexpr std::size_t kFirstBytes = 1 << 16;
constexpr double kNormOff = 0.03;     // of a quaternion or a rotation of few digits
constexpr double kMostDamaged = 0.1;  // share of rows of a trajectory that may be implausible

struct NumberRow {
  int line;  // of the file, from 1
  std::vector<double> numbers;
};

// The rows of a text of `count` numbers a line; none if a line has anything else. The last line may
// be cut where the text ends.
std::vector<NumberRow> RowsOfNumbers(std::size_t count, std::string_view start) {
  std::vector<NumberRow> rows;
  for (int line_number = 1; !start.empty(); ++line_number) {
    const std::size_t end = start.find('\n');
    if (end == std::string_view::npos && !rows.empty()) break;
    const std::string_view line = TrimmedField(start.substr(0, end));
    start.remove_prefix(std::min(end, start.size() - 1) + 1);
    if (line.empty() || line.starts_with('#')) continue;
    std::vector<std::string_view> texts;
    SplitFields(line, ' ', &texts);
    NumberRow row{line_number, std::vector<double>(texts.size())};
    if (texts.size() != count) return {};
    for (std::size_t i = 0; i < count; ++i) {
      if (!ParseNumber(texts[i], &row.numbers[i])) return {};
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

// Rows that can't be those of a trajectory; the first one's place and fault.
struct ImplausibleRows {
  std::size_t count = 0;
  int line = 0;
  std::string what;

  void Add(const NumberRow& row, const std::string& fault) {
    if (count++ > 0) return;
    line = row.line;
    what = fault;
  }
};

// Times rise, and the quaternions x, y, z, w of the last four columns have norm 1.
ImplausibleRows CheckTum(const std::vector<NumberRow>& rows) {
  ImplausibleRows bad;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::vector<double>& row = rows[i].numbers;
    const double norm = std::hypot(std::hypot(row[4], row[5]), std::hypot(row[6], row[7]));
    if (!(std::abs(norm - 1.0) <= kNormOff)) {
      bad.Add(rows[i], fmt::format("a quaternion of norm {:.4g}, not 1", norm));
    } else if (i > 0 && !(row[0] > rows[i - 1].numbers[0])) {
      bad.Add(rows[i], "a time that does not come after the one before");
    }
  }
  return bad;
}

// The upper 3 x 4 of a pose, row by row: a rotation beside a position.
ImplausibleRows CheckKitti(const std::vector<NumberRow>& rows) {
  ImplausibleRows bad;
  for (const NumberRow& row : rows) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> pose(row.numbers.data());
    const Eigen::Matrix3d turn = pose.leftCols<3>();
    const double off = (turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm();
    if (off <= kNormOff && turn.determinant() > 0.0) continue;
    bad.Add(row, "columns 1 to 3, 5 to 7 and 9 to 11 that are no rotation");
  }
  return bad;
}

struct TrajectoryShape {
  const char* name;
  std::size_t columns;
  ImplausibleRows (*check)(const std::vector<NumberRow>& rows);
};
constexpr TrajectoryShape kTumShape = {"TUM trajectory (t tx ty tz qx qy qz qw)", 8, CheckTum};
constexpr TrajectoryShape kKittiShape = {"KITTI poses", 12, CheckKitti};

// Some rows of a trajectory may be damaged.
bool TooMany(std::size_t damaged, std::size_t rows) {
  return static_cast<double>(damaged) > kMostDamaged * static_cast<double>(rows);
}

bool LooksLike(const TrajectoryShape& shape, std::string_view start) {
  const std::vector<NumberRow> rows = RowsOfNumbers(shape.columns, start);
  return !rows.empty() && !TooMany(shape.check(rows).count, rows.size());
}

fs::path AslRoot(const fs::path& folder) {
  return fs::is_directory(folder / "mav0") ? folder / "mav0" : folder;
}

std::vector<fs::path> AslSensors(const fs::path& folder) {
  std::vector<fs::path> sensors;
  for (const auto& entry : fs::directory_iterator(AslRoot(folder))) {
    if (fs::is_regular_file(entry.path() / "data.csv")) sensors.push_back(entry.path());
  }
  std::sort(sensors.begin(), sensors.end());
  return sensors;
}

}  // namespace

bool IsValue(const std::string& text) {
  double value = 0.0;
  TimeNs time = 0;
  return ParseNumber(text, &value) || ParseDateTime(text, &time);
}

CsvLayout GuessCsvLayout(const std::filesystem::path& path) {
  FirstLines start = ReadFirstLines(path);
  std::vector<std::string>& lines = start.lines;
  CsvLayout layout;
  const std::string& typical = RowOf(lines);
  layout.separators = SeparatorsOf(typical);
  const std::vector<std::string> row = Split(typical, layout.separators);
  const Head head = HeadOf(lines, row, layout.separators);
  layout.skip_lines = start.numbers[head.names] - 1;
  const auto names = lines.begin() + static_cast<std::ptrdiff_t>(head.names);
  const double rate = RateStatedIn({lines.begin(), names});
  lines.erase(lines.begin(), names);
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 1; i < lines.size(); ++i) rows.push_back(Split(lines[i], layout.separators));
  auto first = Split(lines.front(), layout.separators);
  layout.header = AreNames(first, rows.empty() ? first : row);
  if (layout.header) first = Split(lines.front(), {layout.separators.delimiter, false});
  layout.units_line = rows.size() > 1 && layout.header && IsUnitsLine(rows.front());
  if (layout.units_line) {
    for (const std::string& text : rows.front()) layout.units.push_back(UnitText(text));
    rows.erase(rows.begin());
  }
  const std::size_t width = rows.empty() ? first.size() : rows.front().size();
  // A comma at the end of the rows alone has no name.
  if (layout.header && first.size() + 1 == width && rows.front().back().empty()) {
    first.emplace_back();
  }
  std::vector<std::string> made = head.joined;
  if (layout.header && first.size() == width + 1 && first.front() == "#") {
    made.assign(first.begin() + 1, first.end());  // blanks separate the mark of a comment, too
  }
  NameColumns(made.empty() ? first : made, width, &layout);
  layout.units.resize(layout.units_line ? layout.columns.size() : 0);
  if (rows.size() > 1) rows.pop_back();  // the last line may be cut off
  if (!layout.header && layout.warning.empty()) made = NamesByShape(rows);
  layout.has_made_names = !made.empty();
  if (layout.has_made_names) layout.columns = made;
  std::vector<std::size_t> all(layout.columns.size());
  std::iota(all.begin(), all.end(), 0);
  layout.time = FindTimeColumns(layout, all, rows, true, &layout.time_problem);
  const auto frame =
      std::find_if(layout.columns.begin(), layout.columns.end(),
                   [](const std::string& name) { return LowerCase(name).starts_with("frame"); });
  if (rate > 0.0 && frame != layout.columns.end() && !(layout.time && layout.time->is_named)) {
    layout.time = TimeColumns{static_cast<std::size_t>(frame - layout.columns.begin())};
    layout.time->frame = 1.0 / rate;
    layout.time->is_named = layout.time->is_stated = true;
    layout.time_problem.clear();
  }
  return layout;
}

bool TableDecoder::Describe(std::string_view, Channel* channel) {
  for (const TableColumn& column : columns_) {
    if (column.time_exponent) channel->stamp_field = static_cast<int>(channel->fields.size());
    channel->fields.push_back({column.name, column.time_exponent ? "ns" : column.unit});
  }
  return true;
}

bool TableDecoder::Decode(std::string_view message, std::vector<Cell>* cells) const {
  std::vector<std::string_view> texts;
  ValueSplitter splitter(separators_);
  splitter.Split(message, &texts);
  if (texts.size() != width_) return false;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const TableColumn& column = columns_[i];
    double value = 0.0;
    if (TimeNs time = 0; column.time_exponent) {
      if (!ParseTime(texts[column.index], *column.time_exponent, &time)) return false;
      (*cells)[i] = Cell(time);
      continue;
    }
    if (!ParseNumber(texts[column.index], &value)) continue;
    (*cells)[i] = Cell(column.scale * value + column.shift);
  }
  return true;
}

void WalkCsv(const std::filesystem::path& path, MessageSink* sink) {
  const CsvLayout layout = GuessCsvLayout(path);
  const std::string unknown = WhyNoTrajectory(path);
  for (const std::string& warning : {layout.warning, unknown}) {
    if (!warning.empty()) sink->Warn(warning);
  }
  std::vector<TableColumn> columns;
  for (std::size_t i = 0; i < layout.columns.size(); ++i) {
    columns.push_back({i, layout.columns[i], layout.units.empty() ? "" : layout.units[i]});
  }
  const std::size_t channel = sink->AddChannel({"rows", 0, ""}, [&] {
    return std::make_unique<TableDecoder>(columns, layout.separators, columns.size());
  });
  LineReader lines(path);
  std::string_view line;
  for (int i = 0; i < layout.LinesBeforeRows(); ++i) lines.Next(&line);
  ValueSplitter splitter(layout.separators);
  std::vector<std::string_view> texts;
  while (lines.NextFilled(&line)) {
    TimeNs time = 0;
    if (layout.time) {
      splitter.Split(line, &texts);
      layout.time->Read(texts, &time);
    }
    sink->Add(channel, time, line);
  }
}

bool IsAsl(const fs::path& folder) { return !AslSensors(folder).empty(); }

void WalkAsl(const fs::path& path, MessageSink* sink) {
  for (const fs::path& sensor : AslSensors(path)) {
    LineReader lines(sensor / "data.csv");
    std::string_view header;
    if (!lines.Next(&header) || !header.starts_with('#')) {
      throw ErrorAt(lines.file(), 1,
                    "must start with the line of column names, '#timestamp [ns],"
                    "...'; restore it");
    }
    std::vector<std::string_view> names;
    SplitFields(header, ',', &names);
    std::vector<TableColumn> fields;
    for (const std::string_view name : names) fields.push_back(ParseAslColumn(fields.size(), name));
    AddRows(&lines, sensor.filename().string(), fields, ',', 0, sink);
  }
}

void WalkTum(const fs::path& path, MessageSink* sink) {
  std::vector<TableColumn> columns;
  for (const char* name : {"t", "tx", "ty", "tz", "qx", "qy", "qz", "qw"}) {
    columns.push_back({columns.size(), name, ""});
  }
  LineReader lines(path);
  AddRows(&lines, "trajectory", columns, ' ', 9, sink);
}

bool IsTum(std::string_view start) { return LooksLike(kTumShape, start); }

bool IsKitti(std::string_view start) { return LooksLike(kKittiShape, start); }

std::string WhyNoTrajectory(const fs::path& path) {
  const std::string start = FirstBytes(path, kFirstBytes);
  for (const TrajectoryShape& shape : {kTumShape, kKittiShape}) {
    const std::vector<NumberRow> rows = RowsOfNumbers(shape.columns, start);
    const ImplausibleRows bad = shape.check(rows);
    if (!TooMany(bad.count, rows.size())) continue;
    return fmt::format(
        "its {} columns of numbers have no names, and they are no {}: line {} has {}. What they "
        "hold is not known; state it in a map, or name the columns in a first line",
        shape.columns, shape.name, bad.line, bad.what);
  }
  return "";
}

}  // namespace trueline
