// A flight as the Gramians see it: states and inputs along it.
#pragma once

#include <functional>
#include <vector>

namespace trueline {

struct NominalPoint {
  std::vector<double> x;  // a system's states
  std::vector<double> u;  // its inputs
};

struct NominalFlight {
  double start = 0.0;  // s
  double end = 0.0;
  std::function<NominalPoint(double t)> at;
};

}  // namespace trueline
