#include "problems/prediction/gzip_columns.h"

#include <algorithm>
#include <cmath>
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

}  // namespace trueline
