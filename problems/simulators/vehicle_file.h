// Vehicles in simulators' files: read, corrected in place, and exported.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "problems/simulators/neutral_vehicle.h"
#include "problems/simulators/parameter_file.h"

namespace trueline {

// The simulators whose files are read, written and corrected. A target is one row of Targets() and
// one file, config/export/..., whose numbers an export replaces. The row's fields say where each
// parameter stands and in what unit: the same table reads a file, writes it and corrects it.

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
  std::string name;  // of NeutralVehicle; raw_...: a number that only other fields use
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

// A field of a target that a file has. The vehicle's number is scale * (number of the file in the
// vehicle's unit) + offset: other links of a model add to its mass and inertia.
struct Reading {
  const FileField* field;
  int rotor;             // -1: of the vehicle
  std::size_t file;      // of VehicleFile::files
  const FileNode* leaf;  // that is written; null: computed in the file, so only read
  double number = 0.0;   // of the file
  double value = 0.0;    // of the vehicle
  double scale = 1.0, offset = 0.0;
  std::string key = {};  // the place in words: the path in the file

  // The number with those of another vehicle where the file makes it of several: a mass that is
  // wrong makes no drag coefficient wrong.
  double Beside(const NeutralVehicle& other) const {
    return scale * field->unit.FromFile(number, other, rotor) + offset;
  }
};

struct VehicleFile {
  const Target* target;
  std::vector<std::shared_ptr<const ParameterFile>> files;  // together one vehicle
  NeutralVehicle vehicle;
  std::vector<Reading> readings;

  std::string Name() const;  // of the file and, where it has several, the vehicle
  // The reading of a field, or of one that states the parameter of that name; null if there is
  // none.
  const Reading* Find(const std::string& name) const;
};

// Adds mass, centre and inertia of a model of links (SDF, URDF), all of which count, to
// file->vehicle, and readings of the heaviest link, which a correction changes. Link poses are in
// the model's frame (SDF) or follow the joints (URDF).
void AddLinks(VehicleFile* file);

// The simulator's order of rotors as its code has it for this vehicle (Target::mirrored).
std::vector<FixedRotor> OrderOf(const VehicleFile& file);

// Thrust and moment that are polynomials in the rotor's speed act as one coefficient of its square
// at a `speed` (rad/s; 0: of hover), a rate of the speed that depends on it as one lag.
void LineariseAt(double speed, VehicleFile* file);

// The vehicles in `paths`. Files that complete each other (the links and the plugins of a model,
// PyFlyt's YAML and URDF) give one. Throws InputError for files of no target and, with line and
// remedy, for numbers that are none.
std::vector<VehicleFile> ReadVehicleFiles(const std::vector<std::string>& paths);

// The texts of the files with the parameters `names` at the values of `vehicle`, byte for byte as
// they were elsewhere.
std::vector<std::string> Corrected(const VehicleFile& file, const NeutralVehicle& vehicle,
                                   const std::vector<std::string>& names);

// The vehicle of files of this target, which need not be on disk.
VehicleFile ReadVehicleTexts(const Target& target, const std::vector<ParameterFile>& files);
// The texts of these files with all numbers that the target states at those of `vehicle`.
std::vector<std::string> WrittenFor(const VehicleFile& skeleton, const NeutralVehicle& vehicle);

}  // namespace trueline
