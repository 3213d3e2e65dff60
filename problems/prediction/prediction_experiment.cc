#include "problems/prediction/prediction_experiment.h"

#include <fmt/format.h>

#include <utility>

#include "problems/calibration/write_calibration.h"
#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/yaml_archive.h"
#include "problems/effects/declaration.h"
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

namespace {

void AddConstants(const RotorPrior& prior, std::vector<FittedNumber>* numbers) {
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    const RotorConstantInfo& info = kRotorConstants[i];
    numbers->push_back({info.name, info.unit, info.meaning, prior.mean[i], info.typical});
  }
}

// One number for each size of an effect.
void AddSizes(const YamlMap& map, PredictedVehicle* vehicle, std::vector<FittedNumber>* numbers) {
  vehicle->effects = ReadEffects(map, DriveKind::kRotors);
  for (const Effect& effect : vehicle->effects) {
    const EffectInfo& info = InfoOf(effect);
    for (const auto& [name, size] : effect.values) {
      RotorExtension extension = RotorExtensionOf({{effect.id, {{name, 1.0}}, effect.term}});
      if (extension.effects.forces.empty() && extension.effects.terms.empty()) {
        map.Fail("effects", effect.id +
                                " is no force that is linear in its size; state constants, "
                                "such as K_x, under numbers");
      }
      const auto parameter = std::ranges::find(info.parameters, name, &EffectParameterInfo::name);
      const bool free = size != 0.0;
      const double typical = free ? std::abs(size) : 1.0;
      numbers->push_back(
          effect.term ? FittedNumber{effect.term->Where() + " " + SymbolsOf(effect.term->with),
                                     effect.term->Unit(), effect.term->Name(), size, typical, free}
                      : FittedNumber{effect.id + "." + name, parameter->unit, info.physics, size,
                                     typical, free});
      vehicle->units.push_back(std::move(extension.effects));
    }
  }
}

void ReadNumbers(const YamlMap& map, std::vector<FittedNumber>* numbers) {
  for (FittedNumber& number : *numbers) {
    if (!map.Has(number.name)) continue;
    const YamlMap entry = map.Child(number.name);
    YamlArchive a(entry);
    a.Value("start", &number.start);
    if (number.start != 0.0) number.typical = std::abs(number.start);
    a.Positive("typical", &number.typical);
    a.Value("free", &number.free);
    entry.Finish();
  }
  map.Finish();
}

}  // namespace

PredictedVehicle ReadPredictedVehicle(const YamlMap& map, std::vector<FittedNumber>* numbers) {
  PredictedVehicle vehicle;
  double gravity = 9.81;  // m/s^2
  YamlArchive(map).Positive("gravity", &gravity);
  const YamlMap stated = map.Child("vehicle");
  vehicle.stated = ReadRotorVehicle(stated, gravity);
  if (vehicle.stated.model.num_rotors() != 4) stated.Fail("rotors", "must list four rotors");
  AddConstants(PriorFromVehicle(vehicle.stated), numbers);
  ReadNumbers(map.Child("numbers"), numbers);
  AddSizes(map, &vehicle, numbers);
  return vehicle;
}

YAML::Node FittedModelNode(const PredictedVehicle& vehicle,
                           const std::vector<FittedNumber>& numbers,
                           const std::vector<double>& values, const std::vector<double>& sigmas,
                           const YAML::Node& provenance) {
  std::vector<ParameterEstimate> constants;
  for (const char* name : {"k_f", "K_x", "K_y", "K_z", "inflow"}) {
    const auto number = std::ranges::find(numbers, name, &FittedNumber::name);
    if (!number->free) continue;
    const std::size_t i = number - numbers.begin();
    constants.push_back({name, values[i], sigmas[i], number->unit, "identified"});
  }
  std::vector<Effect> forces;
  auto size = values.end() - static_cast<std::ptrdiff_t>(vehicle.units.size());
  for (Effect effect : vehicle.effects) {
    for (auto& [name, value] : effect.values) value = *size++;
    if (!effect.term || effect.term->on == TermOn::kForce) forces.push_back(std::move(effect));
  }
  return ModelNode(constants, forces, provenance);
}

YAML::Node NumbersNode(const std::vector<FittedNumber>& numbers, const std::vector<double>& values,
                       const std::vector<double>& sigmas, int digits) {
  YAML::Node node;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!numbers[i].free && values[i] == 0.0) continue;
    node[numbers[i].name] = FlowMap({{"value", Rounded(values[i], digits)},
                                     {"sigma", Rounded(sigmas[i], 2)},
                                     {"unit", numbers[i].unit},
                                     {"status", numbers[i].free ? "fitted" : "held"},
                                     {"about", numbers[i].about}});
  }
  return node;
}

std::string NumbersTable(const std::vector<FittedNumber>& numbers,
                         const std::vector<double>& values, const std::vector<double>& sigmas) {
  std::string table;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!numbers[i].free) continue;
    table += fmt::format("  {:<22}{:>12.5g} +- {:<10.2g}{:<20} {}\n", numbers[i].name, values[i],
                         sigmas[i], numbers[i].unit, numbers[i].about);
  }
  return table;
}

}  // namespace trueline
