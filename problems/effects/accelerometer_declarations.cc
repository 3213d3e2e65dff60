// The declarations of errors of the accelerometer (Li et al. 2019, eq. 15).
#include <algorithm>

#include "problems/effects/declaration.h"

namespace trueline {
namespace {

using Eigen::Vector3d;

void UndoAccelScale(const Effect& effect, const CorrectionContext&, FlightLog* log) {
  for (ImuSample& s : log->imu) s.accel.z() /= 1.0 + effect["s"];
}

// Non-orthogonal axes: the thrust axis measures small shares of the other two.
void UndoAccelCrossAxis(const Effect& effect, const CorrectionContext&, FlightLog* log) {
  for (ImuSample& s : log->imu) {
    s.accel.z() -= effect["l_x"] * s.accel.x() + effect["l_y"] * s.accel.y();
  }
}

void UndoAccelBiasDrift(const Effect& effect, const CorrectionContext& context, FlightLog* log) {
  for (ImuSample& s : log->imu) s.accel.z() -= effect["d"] * context.Since(s.t);
}

// a at the IMU = a + w x (w x r) + dw/dt x r. The rate is differentiated over 30 ms to suppress
// vibration.
void UndoLeverArm(const Effect& effect, const CorrectionContext&, FlightLog* log) {
  constexpr double kReach = 0.015;  // s, to either side
  const Vector3d r(effect["r_x"], effect["r_y"], effect["r_z"]);
  std::vector<ImuSample>& imu = log->imu;
  std::size_t before = 0, after = 0;
  for (std::size_t i = 0; i < imu.size(); ++i) {
    while (SecondsBetween(imu[before].t, imu[i].t) > kReach) ++before;
    while (after + 1 < imu.size() && SecondsBetween(imu[i].t, imu[after].t) < kReach) ++after;
    const std::size_t low = std::min(before, i > 0 ? i - 1 : 0), high = std::max(after, i);
    const double span = SecondsBetween(imu[low].t, imu[high].t);
    const Vector3d dw = (imu[high].gyro - imu[low].gyro) / std::max(span, 1e-6);
    const Vector3d& w = imu[i].gyro;
    imu[i].accel -= w.cross(w.cross(r)) + dw.cross(r);
  }
}

}  // namespace

std::vector<EffectInfo> AccelerometerDeclarations() {
  using enum EntersAt;
  return {
      {
          .id = "accel_scale_z",
          .enters = kAccelerometer,
          .parameters = {{"s", "1", 0.01, 0.5, 0.005}},
          .physics = "the accelerometer's thrust axis reads too much by a constant factor",
          .definition = "a_z measured = (1 + s) a_z + b",
          .separate_by = "climb, dive and turn hard, so that thrust leaves its hover value",
          .drawn = {{"s", 0.04, 0.45, true}},
          .correct_at = CorrectionStage::kImu,
          .correct = UndoAccelScale,
      },
      {
          .id = "accel_bias_drift",
          .enters = kAccelerometer,
          .parameters = {{"d", "m/s^3", 0.001, 0.1, 1e-4}},
          .physics =
              "the bias of the accelerometer's thrust axis drifts, as it does while it warms up",
          .definition = "b_az(t) = b_az + d t",
          .separate_by = "repeat the first lap at the end",
          .drifts = true,
          .drawn = {{"d", 0.0005, 0.008, true}},
          .correct_at = CorrectionStage::kImu,
          .correct = UndoAccelBiasDrift,
          .of_one_flight = true,
          .changes = {"b_az"},
      },
      {
          .id = "imu_lever_arm",
          .enters = kAccelerometer,
          .parameters = {{"r_x", "m", 0.01, 0.3, 0.003},
                         {"r_y", "m", 0.01, 0.3, 0.003},
                         {"r_z", "m", 0.01, 0.3, 0.003}},
          .physics = "an IMU off the centre of mass reads the turning of the body as acceleration",
          .definition = "a measured = a + w x (w x r) + dw/dt x r",
          .separate_by = "turn and flip at high rates without gaining speed",
          .drawn = {{"r_x", 0.02, 0.1, true}, {"r_y", 0.02, 0.1, true}, {"r_z", 0.01, 0.05, true}},
          .correct_at = CorrectionStage::kImu,
          .correct = UndoLeverArm,
      },
      {
          .id = "accel_cross_axis",
          .enters = kAccelerometer,
          .parameters = {{"l_x", "1", 0.01, 0.1, 0.01}, {"l_y", "1", 0.01, 0.1, 0.01}},
          .physics = "the thrust axis of the accelerometer measures a share of the other two",
          .definition = "a_z measured = a_z + l_x a_x + l_y a_y",
          .role = Role::kNuisance,
          .correct_at = CorrectionStage::kImu,
          .correct = UndoAccelCrossAxis,
      },
  };
}

}  // namespace trueline
