// YAML -> SimulationConfig. Every key but `course` may be left out and keeps the default of
// config.h.
#include <fmt/ranges.h>

#include <algorithm>

#include "problems/simulation/config_values.h"
#include "problems/simulation/effects.h"
#include "problems/simulation/variant.h"

namespace trueline {
namespace simulation {
namespace {

void ReadRandomise(const YamlMap& map, SimulationConfig* config) {
  const std::vector<std::string> known = TunableNames(*config);
  for (const std::string& key : map.Keys()) {
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      map.Fail(key,
               fmt::format("can't be drawn at random; use one of: {}", fmt::join(known, ", ")));
    }
    const auto range = map.Get<std::vector<double>>(key);
    if (range.size() != 2 || range[1] < range[0]) map.Fail(key, "needs a range [low, high]");
    config->randomise[key] = {range[0], range[1]};
  }
}

}  // namespace
}  // namespace simulation

SimulationConfig ReadSimulationConfig(const YamlMap& map) {
  using namespace simulation;  // NOLINT(google-build-using-namespace): its own internals
  SimulationConfig config;
  config.name = map.Get<std::string>("name", config.name);
  ReadPositive(map, "duration", &config.duration);
  ReadNotNegative(map, "warm_up", &config.warm_up);
  ReadPositive(map, "gravity", &config.gravity);
  config.course = ReadCourse(map.Child("course"));
  config.vehicle = ReadVehicle(map.ChildOrEmpty("vehicle"), config.gravity);
  config.autopilot = ReadAutopilot(map.ChildOrEmpty("autopilot"));
  config.turbulence = ReadTurbulence(map.ChildOrEmpty("turbulence"));
  config.imu = ReadImu(map.ChildOrEmpty("imu"));
  config.ahrs = ReadAhrs(map.ChildOrEmpty("ahrs"));
  config.detector = ReadDetector(map.ChildOrEmpty("detector"));
  ReadSensors(map, &config.sensors);
  for (const YamlMap& effect : map.Children("effects")) {
    config.effects.push_back(ReadEffect(effect));
  }
  ReadRandomise(map.ChildOrEmpty("randomise"), &config);
  map.Finish();
  return config;
}

}  // namespace trueline
