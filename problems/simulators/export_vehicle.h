// A calibrated vehicle in a simulator's file, and what the simulator can't express of it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/simulators/vehicle_file.h"

namespace trueline {

// A file of an export: its text, and the extension it takes the place of in --out (the first: as
// --out says).
struct ExportedFile {
  std::string extension;
  std::string text;
};

// What a target can't express, and what it costs.
struct Loss {
  std::string name, unit;
  double model, file;          // as the model states it, as the file flies it
  std::optional<double> cost;  // m, at 0.5 s; none: no flight shows it
  std::string text;
};

struct Export {
  std::vector<ExportedFile> files;
  NeutralVehicle vehicle;  // as the target's rotors are ordered, with what stands for what it lacks
  NeutralVehicle read;     // what the exported files state
  std::vector<Loss> lost;
  std::vector<std::string> assumed;  // what the model does not state and the file needs
  double cost = 0.0;                 // m, of all together
};

inline constexpr double kCostSpeed = 5.0;    // m/s, of the flights that costs are told by
inline constexpr double kCostSeconds = 0.5;  // s

// Throws InputError for a vehicle that the target can't have, such as one of six rotors.
Export ExportVehicle(const NeutralVehicle& model, const Target& target);

// Writes the files, the first as `out`, others beside it under its name with their own extension;
// and OUT.lost.yaml.
void WriteExport(const Export& exported, const Target& target, const std::filesystem::path& out);

// What is lost, in words.
std::string LossText(const Export& exported, const Target& target);

}  // namespace trueline
