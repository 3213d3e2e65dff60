// Compares a named cause with the effect hidden in the flight.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "problems/diagnosis/diagnosis.h"
#include "problems/diagnosis/imu_flight.h"
#include "tests/common/bands.h"
#include "tests/simulation/short_flight.h"

namespace trueline::testing_diagnosis {

// Round the gates of iros2016, which are seen exactly.
inline FlightLog FlyHiding(const std::vector<Effect>& effects, std::uint64_t seed) {
  SimulationConfig config = testing_simulation::ReadShipped("iros2016", 0.0, effects);
  config.detector.sigma_factor = 0.05;
  return testing_simulation::Fly(config, seed).log;
}

inline ImuDiagnosisOptions WithoutGain() {
  ImuDiagnosisOptions options;
  options.measure_gain = false;
  return options;
}
inline Diagnosis DiagnoseQuickly(const std::vector<FlightLog>& logs) {
  return Diagnose(logs, WithoutGain());
}
inline Diagnosis DiagnoseQuickly(const FlightLog& log) {
  return DiagnoseQuickly(std::vector<FlightLog>{log});
}

// States a tilt that is too large by 12 %.
inline void ScaleTilt(Eigen::Quaterniond* q) {
  const Eigen::Vector3d down = *q * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ().cross(down);
  if (axis.norm() < 1e-6) return;
  const double more = 0.12 * std::asin(std::min(1.0, axis.norm()));
  *q = Eigen::AngleAxisd(more, axis.normalized()) * *q;
}

// An effect's values, and the expected sigmas by estimated parameter: means over five simulated
// flights. The flights' errors agree with them, or are smaller where the effect's `ordinary` size
// dominates sigma.
struct Hidden {
  std::string id;
  std::map<std::string, double> values;
  std::vector<double> sigma;
};

inline constexpr double kSigmaFactor = 1.5;  // flights of other seeds are within it

// Squared errors in stated sigmas, over causes of flights with independent noise.
struct SquaredErrors {
  double sum = 0.0;
  int count = 0;
};

// The cause is the hidden one, its sigmas are as expected, and errors are within 3.3 of them (0.1
// %).
inline SquaredErrors ExpectCause(const Cause& cause, const Hidden& hidden) {
  SquaredErrors squares;
  EXPECT_EQ(cause.candidate.info->id, hidden.id);
  if (cause.candidate.info->id != hidden.id) return squares;
  const Effect found = cause.effect();
  for (int i = 0; i < cause.value.size(); ++i) {
    const std::string& name = cause.candidate.info->parameters[i].name;
    const std::string what = hidden.id + " " + name;
    const double error = (found[name] - hidden.values.at(name)) / cause.sigma[i];
    EXPECT_LT(std::abs(error), 3.3) << what;
    ExpectSigma(cause.sigma[i], hidden.sigma.at(i), kSigmaFactor, what);
    squares.sum += error * error;
    ++squares.count;
  }
  return squares;
}

// Over several flights together: detects sigmas that are all too large.
inline void ExpectAsLargeAsStated(const std::vector<SquaredErrors>& flights) {
  SquaredErrors all;
  for (const SquaredErrors& flight : flights) {
    all.sum += flight.sum;
    all.count += flight.count;
  }
  ExpectChiSquare(all.sum, all.count, "sizes of causes");
}

}  // namespace trueline::testing_diagnosis
