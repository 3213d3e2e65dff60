#include "problems/rotor/rotor_vehicle.h"

#include <cmath>

#include "problems/common/error.h"
#include "problems/common/yaml_archive.h"

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

std::vector<RotorSpec> ReadRotors(const std::vector<YamlMap>& rotors) {
  std::vector<RotorSpec> specs;
  for (const YamlMap& map : rotors) {
    RotorSpec rotor;
    rotor.position = map.GetVector3("position");
    rotor.axis = map.GetVector3("axis", rotor.axis);
    rotor.spin = map.Get<int>("spin");
    rotor.k_f = map.Get<double>("k_f");
    rotor.k_m = map.Get<double>("k_m");
    if (std::abs(rotor.axis.norm() - 1.0) > 1e-3) map.Fail("axis", "must have length 1");
    if (std::abs(rotor.spin) != 1) map.Fail("spin", "must be 1 or -1 (clockwise from above is 1)");
    if (!(rotor.k_f > 0.0)) map.Fail("k_f", "must be positive, in N s^2");
    if (!(rotor.k_m > 0.0)) map.Fail("k_m", "must be positive, in N m s^2; spin gives the sign");
    map.Finish();
    specs.push_back(rotor);
  }
  return specs;
}

RotorVehicle ReadRotorVehicle(const YamlMap& map, double gravity) {
  RotorVehicle vehicle{Driven(ReadRotors(map.Children("rotors")), gravity), LevelState()};
  if (vehicle.model.num_rotors() == 0) map.Fail("rotors", "names no rotor; list each one");
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
                  "'vehicle' needs mass and rotors where rotor speeds are used");
  }
  std::vector<RotorSpec> rotors;
  double distance = 0.0;
  for (const Rotor& rotor : log.vehicle->rotors) {
    rotors.push_back({rotor.position, rotor.axis, rotor.spin, rotor.k_f, rotor.k_m});
    distance += rotor.position.head<2>().norm() / static_cast<double>(log.vehicle->rotors.size());
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

}  // namespace trueline
