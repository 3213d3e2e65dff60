// The questions of a configuration (config/observe/*.yaml) and of a log, asked one by one.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/strict_yaml.h"
#include "problems/log/flight_log.h"
#include "problems/observability/observe.h"

namespace trueline {

// `progress` hears of each case before it is worked on.
using StepNotice = std::function<void(const std::string&)>;

// All cases of a configuration, in its order. Throws InputError naming file, line and key.
std::vector<CaseResult> RunObserveConfig(const YamlMap& config, const StepNotice& progress);

// What one flight shows: of the rotor-driven model where the log has rotor speeds and a vehicle
// with rotors (`vehicle`, where given, instead of the log's own), of the model of Li et al. where
// it has attitude and fixes. One case each. Throws InputError where neither can be asked.
std::vector<CaseResult> RunObserveLog(const FlightLog& log, const std::optional<YamlMap>& config,
                                      const StepNotice& progress);

}  // namespace trueline
