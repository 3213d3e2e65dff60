// The simulators whose files are read, written and corrected. A target is one row of Targets() and
// one file, config/export/..., whose numbers an export replaces. The row's fields say where each
// parameter stands and in what unit: the same table reads a file, writes it and corrects it.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "problems/simulators/neutral_vehicle.h"
#include "problems/simulators/parameter_file.h"

namespace trueline {

// The number in the file is factor * value^power * (product of other numbers of the vehicle, each
// to its power).
struct NumberUnit {
  double factor = 1.0;
  std::vector<std::pair<const char*, int>> with = {};
  double power = 1.0;

  double ToFile(double value, const NeutralVehicle& vehicle, int rotor) const;
  double FromFile(double number, const NeutralVehicle& vehicle, int rotor) const;
};

struct FileField {
  const char* name;  // of NeutralVehicle; raw_...: a number that only other fields use
  // As ParameterFile::Find. {i}: the rotor's number from 0, {r}: from 1; ./...: in the rotor's
  // element; {./x}: the text of x in it. Such a field has a value for each rotor.
  std::string path;
  NumberUnit unit = {};
  // States again what others state: compared with them, not read.
  bool again = false;

  bool OfRotor() const;
};

// Where mass and inertia stand: in fields, or in the links of a model, whose sum counts.
enum class LinkKind { kNone, kSdf, kUrdf };

// A rotor's place and spin as the simulator's code fixes them: signs of x and y (B), and spin.
struct FixedRotor {
  int x, y, spin;
};

struct Target {
  std::string name;
  std::string about;                   // in words, for --to=list
  std::vector<std::string> skeletons;  // in config/export; the first is the file of --out
  std::string mark;                    // a path that its files, and no others before it, have
  std::vector<FileField> fields;
  std::string rotor_elements = {};  // name of the elements that stand for a rotor each
  std::string rotor_number = {};    // path in it of its number
  LinkKind links = LinkKind::kNone;
  std::vector<FixedRotor> order = {};  // empty: any, as the file says
  // Path and text that tell the vehicle whose rotors the code has left for right; they then turn
  // the other way, too.
  std::pair<std::string, std::string> mirrored = {};
  double gravity = 9.81;  // m/s^2, of the simulator
  bool tables = false;    // each top-level entry is a vehicle
  // Commands are thrusts: rotor speeds, hence k_f and full_speed alone, mean nothing to it.
  bool by_thrust = false;
  std::string also = {};    // another simulator that reads the same file
  std::string caveat = {};  // what its equations do otherwise than Trueline's, in words

  bool Has(const std::string& name) const;
};

const std::vector<Target>& Targets();
// Throws InputError that lists the targets which can be written.
const Target& FindTarget(const std::string& name);
// A line for each target that can be written.
std::string TargetList();

}  // namespace trueline
