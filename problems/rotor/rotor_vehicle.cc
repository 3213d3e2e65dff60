#include "problems/rotor/rotor_vehicle.h"

#include <fmt/ranges.h>

#include <cmath>

#include "problems/common/error.h"
#include "problems/log/log_yaml.h"

namespace trueline {
namespace {

using Driven = RotorDrivenModel;

void Put(const Eigen::Vector3d& value, int index, std::vector<double>* x) {
  for (int i = 0; i < 3; ++i) (*x)[index + i] = value[i];
}

std::vector<double> LevelState() {
  std::vector<double> x(Driven::kStates, 0.0);
  x[Driven::kAttitude] = x[Driven::kThrustScale] = x[Driven::kTorqueScale] = 1.0;
  return x;
}

}  // namespace

RotorVehicle ReadRotorVehicle(const YamlMap& map, double gravity) {
  RotorVehicle vehicle{Driven(ReadRotors(map.Children("rotors")), gravity), LevelState()};
  if (vehicle.model.num_rotors() == 0) map.Fail("rotors", "names no rotor; list each one");
  for (const Rotor& rotor : vehicle.model.rotors()) {
    if (rotor.k_m == 0.0) map.Fail("rotors", "k_m must be positive, in N m s^2");
  }
  const Eigen::Vector3d inertia = map.GetVector3("inertia");
  if (!IsPhysicalInertia(inertia)) {
    map.Fail("inertia",
             "no body has these moments: each must be positive and below the sum of the "
             "other two (kg m^2)");
  }
  YamlArchive(map).Positive("mass", &vehicle.parameters[Driven::kMass]);
  Put(inertia, Driven::kInertia, &vehicle.parameters);
  Put(map.GetVector3("r_BM", Eigen::Vector3d::Zero()), Driven::kCentre, &vehicle.parameters);
  Put(map.GetVector3("r_BP", Eigen::Vector3d::Zero()), Driven::kPoseArm, &vehicle.parameters);
  Put(map.GetVector3("r_BI", Eigen::Vector3d::Zero()), Driven::kImuArm, &vehicle.parameters);
  map.Finish();
  return vehicle;
}

RotorVehicle VehicleFromLog(const FlightLog& log, std::string* warning) {
  if (!log.vehicle || log.vehicle->rotors.empty() || !log.vehicle->mass) {
    throw ErrorAt(log.directory + "/log.yaml", 0,
                  "'vehicle' needs mass and rotors where rotor speeds are used, such as "
                  "{mass: 0.03, rotors: [{position: [0.03, 0.03, 0], spin: 1}, ...]}");
  }
  const std::vector<Rotor>& rotors = log.vehicle->rotors;
  double distance = 0.0;
  for (const Rotor& rotor : rotors) {
    distance += rotor.position.head<2>().norm() / static_cast<double>(rotors.size());
  }
  RotorVehicle vehicle{Driven(rotors, log.gravity), LevelState()};
  const double mass = *log.vehicle->mass;
  const double across = mass * std::pow(0.4 * distance, 2);
  vehicle.parameters[Driven::kMass] = mass;
  Put({across, across, 1.7 * across}, Driven::kInertia, &vehicle.parameters);
  *warning = fmt::format(
      "a log states no inertia: ({:.2g}, {:.2g}, {:.2g}) kg m^2 taken from mass and rotor "
      "positions, "
      "levers taken as zero; sigmas of inertia are only as good; give --config with the vehicle",
      across, across, 1.7 * across);
  return vehicle;
}

namespace {

std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const RotorConstantInfo& info : kRotorConstants) names.push_back(info.name);
  return names;
}

}  // namespace

std::vector<int> RotorPrior::Free() const {
  std::vector<int> free;
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    if (sigma[i] > 0.0) free.push_back(i);
  }
  return free;
}

bool RotorPrior::Estimates(const std::string& name) const {
  return !name.empty() && sigma[FindRotorConstant(name)] > 0.0;
}

RotorConstants RotorPrior::WithKnown(const RotorConstants& constants) const {
  return (sigma.array() == 0.0).select(mean, constants);
}

RotorPrior PriorFromVehicle(const RotorVehicle& vehicle) {
  RotorPrior prior;
  const int moving = RotorAeroModel::kMoving;
  for (int i = moving; i < RotorDrivenModel::kStates; ++i) {
    prior.mean[i - moving] = vehicle.parameters[i];
  }
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    const RotorConstantInfo& info = kRotorConstants[i];
    prior.sigma[i] = info.relative ? info.sigma * prior.mean[i] : info.sigma;
  }
  return prior;
}

void ReadRotorPrior(const YamlMap& map, RotorPrior* prior) {
  for (const std::string& key : map.Keys()) {
    const int i = FindRotorConstant(key);
    if (i < 0) {
      map.Fail(key, fmt::format("is no constant of this model; use {}", fmt::join(Names(), ", ")));
    }
    if (map.RawNode(key).IsMap()) {
      const YamlMap entry = map.Child(key);
      prior->mean[i] = entry.Get<double>("mean", prior->mean[i]);
      prior->sigma[i] = entry.Get<double>("sigma");
      entry.Finish();
    } else {
      prior->sigma[i] = map.Get<double>(key);
    }
    if (!(prior->sigma[i] >= 0.0)) map.Fail(key, "sigma must be zero (known) or above");
  }
  map.Finish();
}

YAML::Node ToYaml(const RotorPrior& prior) {
  YAML::Node node;
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    YAML::Node entry;
    entry["mean"] = prior.mean[i];
    entry["sigma"] = prior.sigma[i];
    entry.SetStyle(YAML::EmitterStyle::Flow);
    node[kRotorConstants[i].name] = entry;
  }
  return node;
}

namespace {

constexpr double kThinnest = 1e-6;  // share of the trace that each second moment has at least

}  // namespace

RotorConstants ToChart(const RotorConstants& constants) {
  RotorConstants chart = constants;
  chart[kMassConstant] = std::log(constants[kMassConstant]);
  const Eigen::Vector3d inertia = constants.segment<3>(kInertiaConstants);
  const Eigen::Vector3d moments = (0.5 * inertia.sum() - inertia.array()).matrix();
  chart.segment<3>(kInertiaConstants) = moments.cwiseMax(kThinnest * inertia.sum()).array().log();
  return chart;
}

RotorConstants FromChart(const RotorConstants& chart) {
  RotorConstants constants = chart;
  constants[kMassConstant] = std::exp(chart[kMassConstant]);
  constants.segment<3>(kInertiaConstants) =
      InertiaFromLogSecondMoments(Vec3<double>(chart.segment<3>(kInertiaConstants)));
  return constants;
}

RotorConstants MovedInChart(const RotorConstants& chart, const RotorConstants& step) {
  const int yaw = FindRotorConstant("k_m");
  const RotorConstants from = FromChart(chart), by = ChartJacobian(chart) * step;
  const Eigen::Array3d inertia = from.segment<3>(kInertiaConstants).array();
  const Eigen::Array3d share = by.segment<3>(kInertiaConstants).array() / inertia;
  RotorConstants moved = chart + step;
  if (!(share < 1.0).all()) return moved;
  RotorConstants to = FromChart(moved);
  to.segment<3>(kInertiaConstants) = (inertia / (1.0 - share)).matrix();
  if (!IsPhysicalInertia(to.segment<3>(kInertiaConstants))) return moved;
  moved.segment<3>(kInertiaConstants) = ToChart(to).segment<3>(kInertiaConstants);
  moved[yaw] = (from[yaw] * (1.0 - share[2]) + by[yaw]) / (1.0 - share[2]);
  return moved;
}

ConstantsJacobian ChartJacobian(const RotorConstants& chart) {
  ConstantsJacobian jacobian = ConstantsJacobian::Identity();
  jacobian(kMassConstant, kMassConstant) = std::exp(chart[kMassConstant]);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      jacobian(kInertiaConstants + i, kInertiaConstants + j) =
          i == j ? 0.0 : std::exp(chart[kInertiaConstants + j]);
    }
  }
  return jacobian;
}

}  // namespace trueline
