// How a system names its error states. Frames and units are those of the model.
#pragma once

#include <string>
#include <vector>

namespace trueline {

struct StateInfo {
  std::string name;
  std::string unit;
  bool moving = false;   // part of the trajectory, so of no interest itself
  double typical = 1.0;  // a usual size of a change, for scaling before a numerical rank
};

inline std::vector<double> TypicalSizes(const std::vector<StateInfo>& states) {
  std::vector<double> sizes(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) sizes[i] = states[i].typical;
  return sizes;
}

// -1 where there is none.
inline int FindState(const std::vector<StateInfo>& states, const std::string& name) {
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (states[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

}  // namespace trueline
