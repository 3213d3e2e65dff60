// Named columns of a CSV file, plain or compressed by gzip.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace trueline {

// A row for each line after the header, a column for each name; further columns are ignored. Throws
// InputError naming file, line and column for a file that is missing, cut off or lacks a number.
Eigen::MatrixXd ReadColumns(const std::filesystem::path& file,
                            const std::vector<std::string>& names);

// Whether the file's header names the column.
bool HasColumn(const std::filesystem::path& file, const std::string& name);

// The files of a folder whose names end in .csv or .csv.gz, sorted by name. Throws InputError where
// there are none.
std::vector<std::filesystem::path> ColumnFiles(const std::filesystem::path& folder);

// The file's name without .csv and .gz.
std::string NameOfColumnFile(const std::filesystem::path& file);

}  // namespace trueline
