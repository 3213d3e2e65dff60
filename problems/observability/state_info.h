// Names of a system's error states. Frames and units are those of the model.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace trueline {

struct StateInfo {
  std::string name;
  std::string unit;
  bool moving = false;   // part of the trajectory, so of no interest itself
  double typical = 1.0;  // typical change, scales numerical ranks
};

inline std::vector<double> TypicalSizes(const std::vector<StateInfo>& states) {
  std::vector<double> sizes(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) sizes[i] = states[i].typical;
  return sizes;
}

// -1 if there is no such state.
inline int FindState(const std::vector<StateInfo>& states, const std::string& name) {
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (states[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

// Adds those of `more` that are not there yet: a state asked for twice would have no inverse.
inline void AddStates(const std::vector<int>& more, std::vector<int>* states) {
  for (const int state : more) {
    if (std::count(states->begin(), states->end(), state) == 0) states->push_back(state);
  }
}

// The same as FindState of a state that does not move; -1 for others.
inline int FindConstant(const std::vector<StateInfo>& states, const std::string& name) {
  const int state = FindState(states, name);
  return state >= 0 && states[state].moving ? -1 : state;
}

// The states of constants of the rotor-driven model, each once. Calls fail(text) for another name.
template <class Fail>
std::vector<int> ConstantsNamed(const std::vector<StateInfo>& states,
                                const std::vector<std::string>& names, const Fail& fail) {
  std::vector<int> found;
  for (const std::string& name : names) {
    const int state = FindConstant(states, name);
    if (state < 0) {
      fail("'" + name +
           "' is no constant of the rotor-driven model; use m, I_x ..., r_BM_x ..., r_BP_x ..., "
           "r_BI_x ..., b_a_x ..., b_w_x ..., k_f, k_m");
    }
    AddStates({state}, &found);
  }
  return found;
}

}  // namespace trueline
