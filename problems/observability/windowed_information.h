// Information on a system's constants for a model that is accurate only over short times: the
// flight is cut into stretches of `horizon` seconds, each with its own trajectory states, and the
// information on the constants is summed. A model without process noise would claim that twenty
// seconds of tumbling show the centre of mass to nanometres. With the horizon set to the time over
// which the model predicts well, the bounds are attainable.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "problems/observability/assessment.h"
#include "problems/observability/variational_gramian.h"

namespace trueline {

// The constants out of `asked`.
inline std::vector<int> ConstantsOf(const std::vector<int>& asked,
                                    const std::vector<StateInfo>& info) {
  std::vector<int> constants;
  for (const int state : asked) {
    if (!info[state].moving) constants.push_back(state);
  }
  return constants;
}

// kErrors x kErrors; rows and columns of trajectory states and of states outside of `asked` are
// zero. `step` is that of VariationalGramian.
template <class System>
Eigen::MatrixXd WindowedInformation(const System& system, const NominalFlight& flight,
                                    const std::vector<double>& weights,
                                    const std::vector<int>& asked, double horizon, double step) {
  const std::vector<int> constants = ConstantsOf(asked, system.errors());
  const std::vector<int> moving = Others(asked, constants);
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(System::kErrors, System::kErrors);
  const int windows =
      std::max(1, static_cast<int>(std::lround((flight.end - flight.start) / horizon)));
  const double length = (flight.end - flight.start) / windows;
  for (int k = 0; k < windows; ++k) {
    NominalFlight part = flight;
    part.start = flight.start + k * length;
    part.end = part.start + length;
    const Eigen::MatrixXd information =
        SchurComplement(VariationalGramian(system, part, weights, step), constants, moving);
    for (std::size_t i = 0; i < constants.size(); ++i) {
      for (std::size_t j = 0; j < constants.size(); ++j) {
        total(constants[i], constants[j]) += information(i, j);
      }
    }
  }
  return total;
}

}  // namespace trueline
