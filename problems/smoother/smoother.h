// The fixed-lag smoother: VGD's window problem with the past marginalised instead of forgotten.
//
// It has states at knots (position, velocity, AHRS drift), preintegrated motion between them, fixes
// with a robust loss, and parameters shared by the whole flight. Like the other estimators it
// predicts every arc from the data before it. Its last window holds the whole flight's parameters.
#pragma once

#include "problems/result/estimate.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

// Model of a false pass: another object was detected as the gate.
struct FalsePassOptions {
  double probability = 0.05;                  // prior probability that a pass is false; 0: never
  static constexpr double kOffset = 2.0;      // m, sigma of its fixes' common error, each axis
  static constexpr double kOffsetRate = 0.2;  // m/s, of its change: what is seen may be nearer
  // Prior probability that the past is wrong: the path starts anew, parameters are kept.
  static constexpr double kLost = 0.001;
};

// Random walks of the shared parameters, each in its unit per sqrt(s). Drag and misalignment belong
// to the airframe and are constant.
struct SmootherOptions {
  double accel_bias_walk = 0.01;            // m/s^2/sqrt(s): b_ax, b_ay, b_az
  double ahrs_error_walk = 0.05 * kDegree;  // rad/sqrt(s): Phi_E_Ep, the slow part of the error
  FalsePassOptions false_pass;

  double WalkOf(ParameterGroup group) const {
    if (group == ParameterGroup::kBias) return accel_bias_walk;
    return group == ParameterGroup::kAhrsError ? ahrs_error_walk : 0.0;
  }
};

void Serialize(YamlArchive* a, SmootherOptions* o);

// Causal, with a lag of vgd.gamma passes. Throws InputError without vgd.process: a rigid trajectory
// has no state to marginalise at. After a break in the flight only the parameters are carried on.
// `processes`: one for each window, as LearnProcess returns them.
EstimatorRun RunSmoother(const FlightData& flight, const VgdOptions& vgd,
                         const SmootherOptions& options,
                         const std::vector<ProcessNoise>& processes);
EstimatorRun RunSmoother(const FlightData& flight, const VgdOptions& vgd,
                         const SmootherOptions& options);

}  // namespace trueline
