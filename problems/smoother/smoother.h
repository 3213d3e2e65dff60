// The fixed-lag smoother: VGD's window problem, whose past is marginalised instead of forgotten.
//
// States at knots (position, velocity, AHRS drift), preintegrated motion between them, fixes with a
// robust loss, parameters shared by the whole flight. It predicts every arc from what was seen
// before it, like the other estimators; its last window holds the whole flight's parameters.
#pragma once

#include "problems/result/estimate.h"
#include "problems/smoother/hypothesis.h"
#include "problems/vgd/vgd_options.h"
#include "problems/window/flight_data.h"

namespace trueline {

// How fast the shared parameters may walk (Wiener processes), each in its unit per sqrt(s). Drag
// and misalignment belong to the airframe and stay.
struct SmootherOptions {
  double accel_bias_walk = 0.01;            // m/s^2/sqrt(s): b_ax, b_ay, b_az
  double ahrs_error_walk = 0.05 * kDegree;  // rad/sqrt(s): Phi_E_Ep, the slow part of the error
  FalsePassOptions false_pass;
};

SmootherOptions ReadSmootherOptions(const YamlMap& map);
YAML::Node ToYaml(const SmootherOptions& options);

// Causal, with a lag of vgd.gamma passes. Needs vgd.process (throws InputError without: a rigid
// trajectory has no state to cut at). After a break in the flight only the parameters carry on.
// `processes`: by window, as LearnProcess gives them.
EstimatorRun RunSmoother(const FlightData& flight, const VgdOptions& vgd,
                         const SmootherOptions& options,
                         const std::vector<ProcessNoise>& processes);
EstimatorRun RunSmoother(const FlightData& flight, const VgdOptions& vgd,
                         const SmootherOptions& options);

}  // namespace trueline
