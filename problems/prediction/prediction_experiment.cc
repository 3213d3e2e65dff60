#include "problems/prediction/prediction_experiment.h"

#include <fmt/format.h>

#include <utility>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/yaml_archive.h"
#include "problems/prediction/prediction_run.h"
#include "problems/result/yaml_text.h"

namespace trueline {

std::string ExperimentKind(const std::filesystem::path& file) {
  return YamlMap::FromFile(file).Get<std::string>("kind", "");
}

void ReadHead(const std::filesystem::path& file, const std::string& kind, const YamlMap& map,
              PredictionExperiment* experiment) {
  experiment->file = file.string();
  experiment->kind = map.GetChoice("kind", {kind}, kind);
  experiment->config = YAML::LoadFile(file.string());
  experiment->name = map.Get<std::string>("name");
  experiment->about = map.Get<std::string>("about", std::string());
}

YAML::Node HeadNode(const PredictionExperiment& experiment) {
  YAML::Node node;
  node["name"] = experiment.name;
  node["about"] = experiment.about;
  node["kind"] = experiment.kind;
  node["provenance"]["version"] = Version();
  node["provenance"]["source"] = experiment.file;
  node["provenance"]["config"] = experiment.config;
  const PredictionInputs& inputs = experiment.inputs;
  if (inputs.shortened) node["provenance"]["short"] = true;
  for (const auto& [name, folder] :
       {std::pair{"data", &inputs.data}, std::pair{"test", &inputs.test}}) {
    if (folder->empty()) continue;
    node["provenance"][name]["folder"] = folder->string();
    for (const std::filesystem::path& file : ColumnFiles(*folder)) {
      node["provenance"][name]["sha256"][file.filename().string()] = Sha256OfFile(file);
    }
  }
  return node;
}

RotorAirVehicle ReadRotorAirVehicle(const YamlMap& map) {
  RotorAirVehicle vehicle;
  YamlArchive a(map);
  a.Positive("mass", &vehicle.mass);
  a.Positive("gravity", &vehicle.gravity);
  a.Positive("radius", &vehicle.radius);
  a.Positive("air_density", &vehicle.air_density);
  for (const YamlMap& rotor : map.Children("rotors")) {
    const int spin = rotor.Get<int>("spin");
    if (std::abs(spin) != 1) rotor.Fail("spin", "must be 1 or -1");
    vehicle.rotors.push_back({rotor.GetVector3("position"), spin});
    rotor.Finish();
  }
  if (vehicle.rotors.size() != 4) map.Fail("rotors", "must list four rotors");
  map.Finish();
  return vehicle;
}

std::vector<PredictionNumber> ReadNumbers(const YamlMap& map, int count, NumberInfo info) {
  std::vector<PredictionNumber> numbers(count);
  for (int i = 0; i < count; ++i) {
    const char* name = info(i).name;
    const YamlMap entry = map.Child(name);
    YamlArchive a(entry);
    a.Value("start", &numbers[i].start);
    const double size = std::abs(numbers[i].start);
    numbers[i].typical = size > 0.0 ? size : 1.0;
    a.Positive("typical", &numbers[i].typical);
    a.Value("free", &numbers[i].free);
    entry.Finish();
  }
  map.Finish();
  return numbers;
}

YAML::Node NumbersNode(const std::vector<PredictionNumber>& numbers,
                       const std::vector<double>& values, const std::vector<double>& sigmas,
                       NumberInfo info, int digits) {
  YAML::Node node;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const RotorAirInfo& about = info(static_cast<int>(i));
    node[about.name] = FlowMap({{"value", Rounded(values[i], digits)},
                                {"sigma", Rounded(sigmas[i], 2)},
                                {"unit", about.unit},
                                {"status", numbers[i].free ? "fitted" : "held"},
                                {"about", about.about}});
  }
  return node;
}

std::string NumbersTable(const std::vector<PredictionNumber>& numbers,
                         const std::vector<double>& values, const std::vector<double>& sigmas,
                         NumberInfo info) {
  std::string table;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!numbers[i].free) continue;
    const RotorAirInfo& about = info(static_cast<int>(i));
    table += fmt::format("  {:<8}{:>12.5g} +- {:<10.2g}{:<8}{}\n", about.name, values[i], sigmas[i],
                         about.unit, about.about);
  }
  return table;
}

}  // namespace trueline
