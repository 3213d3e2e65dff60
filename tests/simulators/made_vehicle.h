// The quadrotor of Wuest et al. 2019 with rotors in the plane of its centre of mass.
#pragma once

#include "problems/simulators/neutral_vehicle.h"

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

}  // namespace trueline
