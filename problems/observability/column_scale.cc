#include "problems/observability/column_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "problems/common/error.h"
#include "problems/common/parallel.h"
#include "problems/observability/assessment.h"
#include "problems/observability/e2log.h"
#include "problems/rotor/rotor_ekf.h"
#include "problems/simulation/simulate_rotor_flight.h"
#include "problems/trajectory/limits.h"

namespace trueline {
namespace {

PiecewisePolynomial ScaleFlight(const RotorVehicle& vehicle, const ColumnScaleOptions& options,
                                int i) {
  Random random(options.seed + i, "scale");
  return RandomFeasibleFlight(vehicle, options.shape, options.limits, &random);
}

std::vector<double> BoundScale(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                               const std::vector<int>& asked, const ColumnScaleOptions& options) {
  std::vector<std::vector<double>> bounds(options.flights);
  ParallelFor(options.flights, options.threads, [&](int i) {
    const RotorFlight flight(vehicle, ScaleFlight(vehicle, options, i));
    E2logOptions e2log;
    e2log.order = 4;
    const Eigen::MatrixXd information = E2log(system, flight, system.OutputWeights(), e2log);
    bounds[i] = Assess(information, asked, system.errors()).sigma;
  });
  std::vector<double> scale = TypicalSizes(system.errors());
  for (std::size_t j = 0; j < asked.size(); ++j) {
    double sum = 0.0;
    int seen = 0;
    for (const auto& sigma : bounds) {
      if (std::isfinite(sigma[j])) sum += sigma[j] * sigma[j], ++seen;
    }
    if (seen > 0) scale[asked[j]] = std::sqrt(sum / seen);
  }
  return scale;
}

RotorSimulation SimulationOf(const RotorVehicle& vehicle, const SensorSet& sensors,
                             const FlightLimits& limits) {
  RotorSimulation simulation(vehicle);
  simulation.noise.accel = sensors.sigma_accel;
  simulation.noise.gyro = sensors.sigma_gyro;
  simulation.noise.position = sensors.sigma_position;
  simulation.noise.attitude = sensors.sigma_attitude;
  simulation.imu_rate = sensors.imu_rate;
  simulation.pose_rate = sensors.pose_rate;
  simulation.limits = limits;
  return simulation;
}

// What the filter estimates at the end of random flight `i`, from a first guess drawn from the
// prior; nothing if the vehicle departs from the path or the filter diverges.
std::optional<RotorConstants> FilteredConstants(const RotorSimulation& simulation,
                                                const ColumnScaleOptions& options, int i) {
  try {
    const Flown flown = Fly(simulation, ScaleFlight(simulation.vehicle, options, i),
                            options.seed + static_cast<std::uint64_t>(i));
    const RotorPrior prior =
        DrawGuess(PriorFromVehicle(simulation.vehicle), flown.truth.constants, options.seed + i);
    return RunRotorEkf(ModelOf(simulation), flown.data, {simulation.noise, prior})
        .history.back()
        .mean;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

std::vector<double> DeviationScale(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                                   const ColumnScaleOptions& options) {
  const RotorSimulation simulation = SimulationOf(vehicle, system.sensors(), options.limits);
  std::vector<std::optional<RotorConstants>> estimates(options.flights);
  ParallelFor(options.flights, options.threads,
              [&](int i) { estimates[i] = FilteredConstants(simulation, options, i); });
  RotorConstants sum = RotorConstants::Zero(), squares = RotorConstants::Zero();
  int flown = 0;
  for (const auto& estimate : estimates) {
    if (estimate) sum += *estimate, ++flown;
  }
  if (flown < 2) {
    throw InputError(
        fmt::format("{} of {} random flights could be flown and filtered; the scale "
                    "'deviation' needs two or more",
                    flown, options.flights));
  }
  for (const auto& estimate : estimates) {
    if (estimate) squares += (*estimate - sum / flown).cwiseAbs2();
  }
  std::vector<double> scale = TypicalSizes(system.errors());
  constexpr int kFirst = RotorDrivenSystem::kMovingErrors;
  for (int i = kFirst; i < RotorDrivenSystem::kErrors; ++i) {
    const double deviation = std::sqrt(squares[i - kFirst] / (flown - 1));
    if (deviation > 0.0) scale[i] = deviation;
  }
  return scale;
}

}  // namespace

std::vector<double> FindColumnScale(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                                    const std::vector<int>& asked,
                                    const ColumnScaleOptions& options) {
  switch (options.kind) {
    case ColumnScale::kBound:
      return BoundScale(system, vehicle, asked, options);
    case ColumnScale::kDeviation:
      return DeviationScale(system, vehicle, options);
    case ColumnScale::kTypical:
      break;
  }
  return TypicalSizes(system.errors());
}

void Serialize(YamlArchive* a, ColumnScaleOptions* o) {
  a->Choice("scale", &o->kind,
            {{"bound", ColumnScale::kBound},
             {"deviation", ColumnScale::kDeviation},
             {"typical", ColumnScale::kTypical}});
  a->Value("scale_flights", &o->flights);
  a->Require(o->flights >= 1, "scale_flights", "must be at least 1");
}

}  // namespace trueline
