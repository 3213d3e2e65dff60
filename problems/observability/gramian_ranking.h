// Scores any flights by the E2LOG Gramian (Boehm et al. 2020, eq. 2-5) and ranks them: trajectories
// of a configuration, files of trajectories, recorded flights.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/yaml_archive.h"
#include "problems/observability/assessment.h"
#include "problems/observability/column_scale.h"
#include "problems/observability/e2log.h"

namespace trueline {

// How flights are scored: the mapping `e2log` of a configuration (config/observe/e2log.yaml).
struct RankingOptions {
  std::vector<std::string> sensors = {"imu", "pose"};
  std::vector<std::string> show = {"r_BP_x", "r_BP_y", "r_BP_z"};  // constants of interest
  std::vector<std::string> free;  // unknown beside the 30 error states of Table I
  E2logOptions e2log{.order = 4, .threads = 0};
  bool marginalise = true;     // other states are unknown too; false: as if known
  bool weigh_by_noise = true;  // false: outputs in their units, as published
  ColumnScaleOptions scale;
};

// What is scored. Trajectories need the configuration's vehicle; a log may bring its own.
struct RankingInputs {
  std::optional<YamlMap> config;
  std::vector<std::filesystem::path> trajectories;  // files as trueline-design writes them
  std::vector<std::filesystem::path> logs;          // native logs with rotor speeds
};

struct RankedFlight {
  std::string name;
  double duration = 0.0;  // s
  GramianScores scores;   // of what is shown, columns scaled
  std::vector<double>
      sigma;  // Cramer-Rao bound by the noise, all else unknown; infinite: not shown
};

struct Ranking {
  RankingOptions options;
  std::vector<StateInfo> shown;
  std::vector<double> scale;          // of what is shown, in its units
  std::vector<RankedFlight> flights;  // the largest sigma_min first
  std::vector<std::string> warnings;
};

// Throws InputError naming file, line and key, or a log that the rotor-driven model does not fit.
Ranking RankByE2log(const RankingInputs& inputs,
                    const std::function<void(const std::string&)>& progress);

// The mapping `e2log` of a configuration; an absent one gives the defaults.
void Serialize(YamlArchive* a, RankingOptions* o);

std::string RankingYaml(const Ranking& ranking, const std::string& source);
std::string RankingTable(const Ranking& ranking);

}  // namespace trueline
