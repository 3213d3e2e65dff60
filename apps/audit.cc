// placeholder
#include <fmt/format.h>
#include <gflags/gflags.h>
#include "problems/common/app.h"
#include "problems/simulators/check_vehicle.h"
DEFINE_string(simulator, "", "files");
namespace {
int Run() {
  const auto files = trueline::ReadVehicleFiles(trueline::SplitPaths(FLAGS_simulator));
  for (const auto& file : files) {
    const auto& v = file.vehicle;
    fmt::print("{} ({}): m {:.4g} I {:.4g} {:.4g} {:.4g} k_f {:.4g} c {:.4g} w_h {:.1f} T/W {:.2f} tau {:.4g} K {:.3f} n {} arm {:.4g} rz {:.4g}\n", file.Name(), file.target->name, v.Get("m"), v.Get("I_x"), v.Get("I_y"), v.Get("I_z"), v.Get("k_f"), v.Get("k_m")/v.Get("k_f"), v.Get("w_h"), std::pow(v.Get("full_speed")/v.Get("w_h"),2), v.Get("tau"), v.Get("K_x") - v.Get("rotor_speed_drag")*v.Get("S_h"), v.rotors.size(), v.Get("arm"), v.Get("r_BM_z"));
    for (const auto& f : trueline::CheckVehicle(file)) fmt::print("   {}:{}: {} = {:.4g} {}: {}\n", f.file, f.line, f.parameter, f.value, f.unit, f.text);
  }
  for (const auto& f : trueline::CompareVehicles(files)) fmt::print("   DIFF {}:{}: {} {}\n", f.file, f.line, f.parameter, f.text);
  return 0;
}
}
int main(int argc, char** argv) { return trueline::RunApp("trueline-audit", "x", &argc, &argv, Run); }
