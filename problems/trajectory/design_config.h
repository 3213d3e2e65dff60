// A design from its configuration (config/design/*.yaml) to its files.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "problems/common/strict_yaml.h"
#include "problems/observability/vehicle_config.h"
#include "problems/trajectory/design.h"

namespace trueline {

struct DesignTask {
  std::string source;
  RotorVehicle vehicle;
  RotorDrivenSystem system;
  DesignTarget target;  // scale is filled in by RunDesignTask
  DesignOptions options;
  int scale_flights = 30;  // random flights that give the columns' scale
  int compare = 0;         // random flights, and as many Lissajous figures, to compare with
};

struct DesignOutcome {
  DesignResult result;
  double exact_score = 0.0;  // the result's score by the exact Gramian instead of E2LOG
  std::vector<double> scale;
  std::vector<double> random_scores;        // sorted
  std::vector<double> lissajous_scores;     // sorted
  std::vector<double> sigma, random_sigma;  // Cramer-Rao (whole flight) of the states of interest:
                                            // designed, and of a random flight
};

// Throws InputError naming file, line and key.
DesignTask ReadDesignTask(const YamlMap& config, std::uint64_t seed, int threads);

DesignOutcome RunDesignTask(const DesignTask& task,
                            const std::function<void(const std::string&)>& progress);

// trajectory.yaml, trajectory.csv and score.yaml in `directory`.
void WriteDesign(const DesignTask& task, const DesignOutcome& outcome,
                 const std::filesystem::path& directory);

std::string DesignTable(const DesignTask& task, const DesignOutcome& outcome);

}  // namespace trueline
