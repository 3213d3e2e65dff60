// Vehicles in simulators' files: read, corrected in place, and exported.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "problems/simulators/target.h"

namespace trueline {

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
// the model's frame (SDF) or follow the joints (URDF). In model_links.cc.
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
