#include "problems/prediction/prediction_run.h"

#include <algorithm>
#include <cmath>
#include <regex>
#include <set>

#include "problems/common/error.h"
#include "problems/log/csv_text.h"
#include "problems/log/text_file.h"

namespace trueline {
namespace {

std::vector<std::size_t> IndicesOf(const std::vector<std::string>& names,
                                   const std::vector<std::string_view>& header,
                                   const std::string& file) {
  std::vector<std::size_t> indices;
  for (const std::string& name : names) {
    const auto found = std::find_if(header.begin(), header.end(), [&](std::string_view field) {
      return TrimmedField(field) == name;
    });
    if (found == header.end()) {
      throw ErrorAt(file, 1,
                    "has no column '" + name + "'; it must name all columns in its header");
    }
    indices.push_back(static_cast<std::size_t>(found - header.begin()));
  }
  return indices;
}

}  // namespace

Eigen::MatrixXd ReadColumns(const std::filesystem::path& file,
                            const std::vector<std::string>& names) {
  LineReader lines(file);
  std::vector<std::size_t> indices;
  std::vector<std::string_view> fields;
  std::vector<double> values;
  std::string_view row;
  while (lines.NextFilled(&row)) {
    SplitFields(row, ',', &fields);
    if (indices.empty()) {
      indices = IndicesOf(names, fields, file.string());
      continue;
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
      double value = 0.0;
      if (indices[i] >= fields.size() || !ParseNumber(TrimmedField(fields[indices[i]]), &value) ||
          !std::isfinite(value)) {
        throw ErrorAt(file.string(), lines.line_number(),
                      "column '" + names[i] + "' holds no finite number");
      }
      values.push_back(value);
    }
  }
  if (values.empty()) throw ErrorAt(file.string(), 0, "has no rows");
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto width = static_cast<Eigen::Index>(names.size());
  return Eigen::Map<const Rows>(values.data(), static_cast<Eigen::Index>(values.size()) / width,
                                width);
}

bool HasColumn(const std::filesystem::path& file, const std::string& name) {
  LineReader lines(file);
  std::string_view header;
  lines.Next(&header);
  std::vector<std::string_view> fields;
  SplitFields(header, ',', &fields);
  return std::any_of(fields.begin(), fields.end(),
                     [&](std::string_view field) { return TrimmedField(field) == name; });
}

std::vector<std::filesystem::path> ColumnFiles(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::is_directory(folder)) {
    throw InputError(folder.string() + ": is no folder; give the one that holds the .csv.gz files");
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".csv") || name.ends_with(".csv.gz")) files.push_back(entry.path());
  }
  if (files.empty()) throw InputError(folder.string() + ": holds no .csv or .csv.gz file");
  std::sort(files.begin(), files.end());
  std::set<std::string> names;
  for (const std::filesystem::path& file : files) {
    if (names.insert(NameOfColumnFile(file)).second) continue;
    throw InputError(file.string() + ": is there twice, packed and plain; remove one");
  }
  return files;
}

std::string NameOfColumnFile(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  return name.substr(0, name.rfind(".csv"));
}

namespace {

// "melon" of "melon_20251017_run1", "melon-2" and "Melon run 3"; runs with nothing but a number are
// of one trajectory.
std::string TrajectoryOf(const std::string& name) {
  const std::size_t end = name.find('_');
  if (end != std::string::npos) return name.substr(0, end);
  static const std::regex number("[ .-]*(run)?[ .-]*[0-9]+$", std::regex::icase);
  const std::string trajectory = std::regex_replace(name, number, "");
  return trajectory.empty() ? "run" : trajectory;
}

PredictionRun ReadRun(const std::filesystem::path& file) {
  const Eigen::MatrixXd rows =
      ReadColumns(file, {"t", "x", "y", "z", "vx", "vy", "vz", "qw", "qx", "qy", "qz", "wx", "wy",
                         "wz", "m1_rads", "m2_rads", "m3_rads", "m4_rads"});
  PredictionRun run;
  run.name = NameOfColumnFile(file);
  run.trajectory = TrajectoryOf(run.name);
  run.states = rows.middleCols<13>(1).transpose();
  run.speeds = rows.rightCols<4>().transpose();
  if (run.num_windows() < 1) {
    throw ErrorAt(
        file.string(), 0,
        fmt::format("has {} rows; one window needs {}", rows.rows(), PredictionWindow::kSteps + 1));
  }
  for (Eigen::Index i = 0; i + 1 < rows.rows(); ++i) {
    if (std::abs(rows(i + 1, 0) - rows(i, 0) - StabilisedProcess::kStep) > 1e-4) {
      throw ErrorAt(file.string(), static_cast<int>(i) + 3,
                    "t [s] must grow by 0.01 from row to row; resample the run to 100 Hz");
    }
  }
  return run;
}

}  // namespace

std::vector<PredictionRun> ReadPredictionRuns(const std::filesystem::path& folder) {
  std::vector<PredictionRun> runs;
  for (const std::filesystem::path& file : ColumnFiles(folder)) runs.push_back(ReadRun(file));
  return runs;
}

PredictionWindow WindowAt(const PredictionRun& run, int row) {
  PredictionWindow window;
  const auto state = run.states.col(row);
  window.p = state.segment<3>(0);
  window.v = state.segment<3>(3);
  window.q = state.segment<4>(6).normalized();
  window.w = state.segment<3>(10);
  for (int k = 0; k < PredictionWindow::kSteps; ++k) {
    const int next = std::min(k + 1, PredictionWindow::kSteps - 1);
    for (int i = 0; i < 4; ++i) {
      const double a = run.speeds(i, row + k), b = run.speeds(i, row + next);
      window.rotors[k].speeds.push_back(std::sqrt(0.5 * (a * a + b * b)));
      window.rotors[k].accelerations.push_back((b - a) / StabilisedProcess::kStep);
    }
  }
  return window;
}

WindowTruth TruthAfter(const PredictionRun& run, int row) {
  WindowTruth truth;
  for (std::size_t i = 0; i < WindowTruth::kHorizons.size(); ++i) {
    const auto state = run.states.col(row + WindowTruth::kHorizons[i]);
    truth.states[i] = {state[2], state.segment<3>(3), state.segment<4>(6), state.segment<3>(10)};
  }
  return truth;
}

}  // namespace trueline
