// Position and velocity along a mocap record.
#pragma once

#include <optional>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

// Velocity at each sample (m/s, E): difference over the samples within +-0.1 s, at least over the
// neighbours. The span suppresses position noise of millimetres.
std::vector<Eigen::Vector3d> PathVelocity(const std::vector<PoseSample>& mocap);

inline constexpr double kMocapGap = 0.2;  // s, across which a path is known from its ends

// Position at `t` (m, E), linear between the neighbouring samples. Nothing outside the record, or
// where the neighbours are further apart than `max_gap` (s).
std::optional<Eigen::Vector3d> PositionAt(const std::vector<PoseSample>& mocap, TimeNs t,
                                          double max_gap = kMocapGap);

}  // namespace trueline
