// States and inputs along a flight, for the Gramians.
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
