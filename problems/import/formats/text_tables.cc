#include "problems/import/formats/text_tables.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/import/formats/bytes.h"
#include "problems/import/formats/csv_table.h"
#include "problems/log/csv_text.h"
#include "problems/log/text_file.h"

namespace trueline {
namespace {

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
