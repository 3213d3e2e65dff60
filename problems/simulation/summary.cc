#include "problems/simulation/summary.h"

#include <cmath>

namespace trueline::simulation {

void DescribeAhrs(SimulationTruth* truth) {
  const Quaterniond q_B_I = FrameChange(truth->config.imu.misalignment);
  Vector3d sum = Vector3d::Zero(), squares = Vector3d::Zero();
  const TruthSample& first = truth->trajectory.front();
  const Vector3d origin = EulerOf(first.q_Ep_I * (first.q_E_B * q_B_I).conjugate());
  double tilt_squares = 0.0;
  for (const TruthSample& sample : truth->trajectory) {
    const Quaterniond q_Ep_E = sample.q_Ep_I * (sample.q_E_B * q_B_I).conjugate();
    const Vector3d angles = EulerOf(q_Ep_E) - origin;  // avoids cancellation in squares
    const double tilt = std::acos(std::min(1.0, (q_Ep_E * Vector3d::UnitZ()).z()));
    sum += angles;
    squares += angles.cwiseAbs2();
    tilt_squares += tilt * tilt;
    truth->tilt_error_max = std::max(truth->tilt_error_max, tilt);
  }
  const auto count = static_cast<double>(truth->trajectory.size());
  const Vector3d mean = sum / count;
  truth->ahrs_error_mean = origin + mean;
  truth->ahrs_error_sigma = (squares / count - mean.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
  truth->tilt_error_rms = std::sqrt(tilt_squares / count);
}

void DescribeFlight(const PathErrors& errors, SimulationTruth* truth) {
  const auto count = static_cast<double>(truth->trajectory.size());
  for (const TruthSample& sample : truth->trajectory) {
    truth->accel_walk_mean += sample.accel_walk / count;
    truth->speed_mean += sample.v_E.norm() / count;
    truth->speed_max = std::max(truth->speed_max, sample.v_E.norm());
  }
  truth->path_error_rms = errors.Rms();
  truth->path_error_max = errors.largest;
}

}  // namespace trueline::simulation
