// Flights of the NeuroBEM data set.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cost_functions/wrench_residual.h"

namespace trueline {

struct WrenchFlight {
  std::string name;
  std::vector<WrenchRow> rows;
  // Published predictions of the same rows where the file has them: force [N], moment [N m].
  std::optional<Eigen::Matrix<double, 6, Eigen::Dynamic>> published;
};

// Reads FOLDER/NAME.csv.gz (or .csv).
WrenchFlight ReadWrenchFlight(const std::filesystem::path& folder, const std::string& name);

}  // namespace trueline
