// Information on a system's constants when its motion is trusted only for a while: the flight is
// cut into stretches of `horizon` seconds, each with trajectory states of its own, and their
// information on the constants adds up. Without this a model without process noise claims that
// twenty seconds of tumbling show the centre of mass to nanometres; a horizon of the time over
// which the model's prediction is good gives bounds that an estimator can reach.
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

// kErrors x kErrors; rows and columns of trajectory states and of states not asked for are zero.
// `step` is that of VariationalGramian.
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
        Marginalise(VariationalGramian(system, part, weights, step), constants, moving);
    for (std::size_t i = 0; i < constants.size(); ++i) {
      for (std::size_t j = 0; j < constants.size(); ++j) {
        total(constants[i], constants[j]) += information(i, j);
      }
    }
  }
  return total;
}

}  // namespace trueline
