// Simulated flights for the tests of windows and fits, generated in memory.
#pragma once

#include "problems/common/random.h"
#include "problems/simulation/config.h"
#include "problems/simulation/simulate.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd.h"
#include "tests/simulation/short_flight.h"

namespace trueline::testing_vgd {

// The fit whose model is exact on the exact hippodrome: one rigid integration, plain least squares.
inline VgdOptions RigidOptions() {
  VgdOptions options;
  options.process = {};
  options.adapt_drift = false;
  options.drag_measurement.enabled = false;
  options.loss = FixLoss::kNone;
  return options;
}

inline SimulationConfig ExactHippodrome(double duration) {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome_exact");
  config.duration = duration;
  config.warm_up = 5.0;
  return config;
}

// A log with its FlightData, which points to it.
struct Flight {
  Flight(const SimulationConfig& config, std::uint64_t seed, const VgdOptions& options)
      : flown(testing_simulation::Fly(config, seed)),
        data(flown.log, options.drive, options.passes, options.drag_measurement) {}
  Flight(const Flight&) = delete;
  Flight& operator=(const Flight&) = delete;

  testing_simulation::Flown flown;
  FlightData data;
};

// The flight's last window, from the priors' means.
inline WindowEstimate SolveLast(const Flight& flight, const VgdOptions& options) {
  const int tau = static_cast<int>(flight.data.passes.size());
  return SolveWindow(flight.data, options, tau, PriorMeans(options));
}

// The parameters of eq. 16 as the simulator flew them.
inline Theta TrueTheta(const SimulationConfig& config) {
  const auto values = TunableValues(config);
  Theta theta;
  for (int i = 0; i < kMotionSize; ++i) theta[i] = values.at(kTheta[i].name);
  return theta;
}

inline const ParameterEstimate& Find(const WindowEstimate& window, const std::string& name) {
  for (const ParameterEstimate& p : window.parameters) {
    if (p.name == name) return p;
  }
  throw std::out_of_range(name);
}

// Sum over a run's arcs of the squared error of the end by its covariance.
inline double SquaredArcErrors(const EstimatorRun& run) {
  double sum = 0.0;
  for (const WindowEstimate& window : run.windows) {
    if (!window.arc || !window.arc->truth) continue;
    const Eigen::Vector2d error = *window.arc->truth - window.arc->p_E;
    sum += error.dot(window.arc->cov.inverse() * error);
  }
  return sum;
}

}  // namespace trueline::testing_vgd
