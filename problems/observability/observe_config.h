// Runs the questions of a configuration (config/observe/*.yaml), or those about a log, one by one.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/strict_yaml.h"
#include "problems/log/flight_log.h"
#include "problems/observability/observe.h"

namespace trueline {

// Called with each case's name before it runs.
using StepNotice = std::function<void(const std::string&)>;

// All cases of a configuration, in its order. Throws InputError naming file, line and key.
std::vector<CaseResult> RunObserveConfig(const YamlMap& config, const StepNotice& progress);

// Assesses one flight, one case for each applicable model: the rotor-driven model if the log has
// rotor speeds and a vehicle with rotors (`vehicle`, if given, replaces the log's), and that of Li
// et al. if it has attitude and positions, or where it is the only one that can be asked: the
// program's own filter then gives the attitude. Throws InputError if neither applies.
std::vector<CaseResult> RunObserveLog(const FlightLog& log, const std::optional<YamlMap>& config,
                                      const StepNotice& progress);

}  // namespace trueline
