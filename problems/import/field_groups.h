// Fields of a channel that belong together, and their unit, by what their names say.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "problems/import/formats/recording.h"

namespace trueline {

// Fields that differ only in their last part, as in "acc_x", "q[0]" or "q0", or in their first one,
// as in "x_acc". North, east, down and up are the parts "n", "e", "d" and "u".
struct FieldGroup {
  std::string stem;                          // in lower case
  std::string_view unit;                     // of the first that states one; empty without any
  std::map<std::string, std::string> parts;  // field by its part: "x", "0" or "[0]"
};

// Groups of setpoints and estimates come after all others.
std::vector<FieldGroup> GroupsOf(const Channel& channel);

// The fields roll, pitch and yaw, or phi, theta and psi, of one stem, as the parts "x", "y" and
// "z"; empty if there are none.
FieldGroup EulerAnglesOf(const Channel& channel);
// The fields of their rates, as in "roll_rate".
std::vector<FieldGroup> AngleRatesOf(const Channel& channel);

// The words of a name, in lower case.
std::vector<std::string> WordsOf(const std::string& name);

// Whether a word of the name says that it is of a setpoint or an estimate.
bool IsSetpointOrEstimate(const std::string& name);

}  // namespace trueline
