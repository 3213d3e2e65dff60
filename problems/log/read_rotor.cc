#include "problems/log/read_rotor.h"

#include <fmt/format.h>

namespace trueline {
namespace {

Rotor ReadRotor(const YamlMap& map) {
  Rotor rotor;
  rotor.position = map.GetVector3("position");
  rotor.axis = map.GetVector3("axis", rotor.axis);
  if (!(rotor.axis.norm() > 0.0)) map.Fail("axis", "has no direction; give the axis of thrust");
  rotor.axis.normalize();
  rotor.spin = map.Get<int>("spin");
  if (rotor.spin != 1 && rotor.spin != -1) {
    map.Fail("spin", fmt::format("found {}; use 1 (clockwise from above) or -1", rotor.spin));
  }
  rotor.k_f = map.Get<double>("k_f");
  if (!(rotor.k_f > 0.0)) {
    map.Fail("k_f", fmt::format("found {}; must be positive, in N s^2", rotor.k_f));
  }
  rotor.k_m = map.Get<double>("k_m");
  if (!(rotor.k_m >= 0.0)) {
    map.Fail("k_m", fmt::format("found {}; must not be negative, in N m s^2: spin gives the sign",
                                rotor.k_m));
  }
  map.Finish();
  return rotor;
}

}  // namespace

std::vector<Rotor> ReadRotors(const std::vector<YamlMap>& rotors) {
  std::vector<Rotor> read;
  read.reserve(rotors.size());
  for (const YamlMap& map : rotors) read.push_back(ReadRotor(map));
  return read;
}

}  // namespace trueline
