// The quadrotor of Wuest et al. 2019 with rotors in the plane of its centre of mass.
#pragma once

#include "problems/simulators/audit.h"
#include "problems/simulators/export_vehicle.h"
#include "problems/simulators/neutral_vehicle.h"
#include "tests/common/test_files.h"

namespace trueline {

inline NeutralVehicle MadeQuadrotor() {
  NeutralVehicle v;
  v.name = "made";
  v.body = {{"m", 0.2463},   {"I_x", 0.623e-3}, {"I_y", 0.678e-3}, {"I_z", 1.076e-3},
            {"r_BM_x", 0.0}, {"r_BM_y", 0.0},   {"r_BM_z", 0.0}};
  const int signs[4][3] = {{1, 1, -1}, {-1, -1, -1}, {1, -1, 1}, {-1, 1, 1}};
  for (const auto& [x, y, spin] : signs) {
    v.rotors.push_back({{"x", 0.071 * x},
                        {"y", 0.08 * y},
                        {"z", 0.0},
                        {"spin", spin},
                        {"k_f", 3.811e-7},
                        {"k_m", 3.62e-9}});
  }
  return v;
}

// What an audit names.
inline std::vector<std::string> Names(const Audit& audit) {
  std::vector<std::string> names;
  for (const Contradicted& entry : audit.contradicted) names.push_back(entry.parameter);
  return names;
}

class MadeFile : public testing::Test {
 protected:
  // The file of a vehicle in a target's format, at `path_`. Its text.
  std::string Export(const NeutralVehicle& vehicle, const std::string& to) {
    const Target& target = FindTarget(to);
    const trueline::Export exported = ExportVehicle(vehicle, target);
    path_ = folder_ / ("vehicle" + exported.files[0].extension);
    WriteExport(exported, target, path_);
    return exported.files[0].text;
  }
  // The files of `path_`, with this text.
  std::vector<VehicleFile> Files(const std::string& text) const {
    std::ofstream(path_) << text;
    return ReadVehicleFiles({path_.string()});
  }
  // `text` with all places of `from` replaced; there must be one.
  static std::string Replaced(std::string text, const std::string& from, const std::string& to) {
    std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    for (; at != std::string::npos; at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
    return text;
  }

  TestFolder folder_;
  std::filesystem::path path_;
};

}  // namespace trueline
