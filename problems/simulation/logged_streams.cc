#include "problems/simulation/logged_streams.h"

#include <cmath>

namespace trueline::simulation {

void LowPassGyro(double cutoff, std::vector<ImuSample>* imu) {
  const double period =
      SecondsBetween(imu->front().t, imu->back().t) / static_cast<double>(imu->size() - 1);
  const double w = std::tan(M_PI * cutoff * period);  // pre-warped
  const double scale = 1.0 / (1.0 + std::sqrt(2.0) * w + w * w);
  const double a1 = 2.0 * (w * w - 1.0) * scale, a2 = (1.0 - std::sqrt(2.0) * w + w * w) * scale;
  Eigen::Vector3d in1 = imu->front().gyro, in2 = in1, out1 = in1, out2 = in1;
  for (ImuSample& s : *imu) {
    const Eigen::Vector3d out = w * w * scale * (s.gyro + 2.0 * in1 + in2) - a1 * out1 - a2 * out2;
    in2 = in1, in1 = s.gyro, out2 = out1, out1 = out;
    s.gyro = out;
  }
}

void StampLater(double delay, std::vector<ChannelsSample>* samples) {
  for (ChannelsSample& s : *samples) s.t += FromSeconds(delay);
}

}  // namespace trueline::simulation
