// VGD-kinematic on simulated laps whose IMU has biases and no noise.
#include "problems/vgd/vgd_kinematic.h"

#include <gtest/gtest.h>

#include "problems/result/statistics.h"
#include "problems/simulation/simulate.h"
#include "tests/common/arcs.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

const Eigen::Vector3d kAccelBias(0.12, -0.10, 0.15), kGyroBias(0.006, -0.004, 0.005);

// Exact physics and near-exact fixes; AHRS off by a constant 0.7 to 1.1 deg.
FlightLog BiasedFlight() {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome_exact");
  config.duration = 20.0;
  config.warm_up = 5.0;
  config.imu.accel_bias = kAccelBias;
  config.imu.gyro_bias = kGyroBias;
  config.imu.misalignment.setZero();
  config.detector.sigma_factor = 0.0;
  config.detector.sigma_floor = 0.002;
  return Simulate(config, 1);
}

class VgdKinematicTest : public testing::Test {
 protected:
  EstimatorRun Run(const KinematicOptions& options) const {
    return RunVgdKinematic(flight_, VgdOptions(), options);
  }
  static double MedianError(const EstimatorRun& run) {
    std::vector<double> errors;
    for (const WindowEstimate& window : run.windows) {
      if (window.arc && window.gamma == 3) errors.push_back(window.arc->FinalPointError());
    }
    return Quantile(errors, 0.5);
  }

  const FlightLog log_ = BiasedFlight();
  const FlightData flight_{log_, DriveOptions(), PassOptions(), DragMeasurementOptions()};
};

TEST_F(VgdKinematicTest, FindsBiasesAndTheArcsEnd) {
  KinematicOptions options;  // the simulated IMU has biases and no noise
  options.noise = {0.0, 0.0, 0.0, 0.0};
  options.gyro_from_log = false;
  const EstimatorRun run = Run(options);
  const WindowEstimate& last = run.windows.back();
  ASSERT_TRUE(last.converged);
  Eigen::Matrix<double, 6, 1> truth;
  truth << kAccelBias, kGyroBias;
  for (int i = 0; i < 6; ++i) {
    const ParameterEstimate& found = last.parameters[i];
    EXPECT_EQ(found.status, "identified") << found.name;
    EXPECT_NEAR(found.value, truth[i], 3.5 * found.sigma) << found.name;
    EXPECT_LT(found.sigma, 0.002) << found.name;
  }
  EXPECT_LT(MedianError(run), 0.06);  // its 15 unknowns amplify the fixes' 2 mm to 4 cm
}

// Eq. 38 assumes that the AHRS is exact at the window's start; here it is off by a degree.
TEST_F(VgdKinematicTest, WithoutInitialAttitudeTheAhrsErrorRemains) {
  KinematicOptions paper;
  paper.initial_attitude = false;
  const EstimatorRun with = Run(KinematicOptions()), without = Run(paper);
  EXPECT_EQ(without.windows.back().parameters.size(), 6U);
  EXPECT_EQ(with.windows.back().parameters.size(), 9U);
  EXPECT_GT(MedianError(without), 2.0 * MedianError(with));
}

TEST_F(VgdKinematicTest, CovarianceCoversTheArcsEnd) {
  const ArcCount arcs = CountArcs(Run(KinematicOptions()));
  EXPECT_GE(arcs.count, 3);
  ExpectCovered(arcs);
}

}  // namespace
}  // namespace trueline
