// How the motor commands of a flight turn the vehicle, by what its reference flights show.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

struct CommandResponse {
  // s: until a command acts; time constant of the motors. Both as stamps and the controller's own
  // answer to the turns let them appear, so smaller than the true ones. A command that comes after
  // a turn is never asked, though it would explain more: it answers the turn.
  double delay = 0.0, lag = 0.0;
  // Share of the flight's angular acceleration about x, y, z of the body that is explained: 1 minus
  // the mean square of what is left over the variance (R^2). Below 0: worse than its mean.
  Eigen::Vector3d explained = Eigen::Vector3d::Zero();
  // The same where the trim is that of the references, and not followed over 2 s of the past.
  Eigen::Vector3d explained_without_trim = Eigen::Vector3d::Zero();
};

// Angular acceleration, as differences of the gyroscope's means over 50 ms, is a sum of: thrust and
// change of speed of each motor (its command through delay and lag), turn rates, the vehicle's own
// momentum, and air speed along the body's axes (momentum theory's moments of first order; by
// positions and attitude). All numbers come from the references. No value where a log lacks
// commands, gyroscope or poses, or flies for less than a few seconds.
std::optional<CommandResponse> ResponseOf(const FlightLog& flight,
                                          const std::vector<const FlightLog*>& references);

}  // namespace trueline
