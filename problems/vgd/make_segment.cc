#include "problems/vgd/make_segment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "problems/log/samples_between.h"

namespace trueline {
namespace {

constexpr TimeNs kPathStep = 100'000'000;  // 0.1 s

}  // namespace

std::unique_ptr<Segment> MakeSegment(const DriveTrack& track, const WindowData& data, TimeNs from,
                                     TimeNs to, const ParameterScaling& scaling, double max_block) {
  const TimeNs before = to == data.end ? to + 1 : to;
  std::vector<TimeNs> times{to}, force_times;
  for (const Fix& fix : SamplesBetween(data.fixes, from, before)) times.push_back(fix.t);
  for (const ForceSample& force : SamplesBetween(data.forces, from, before)) {
    force_times.push_back(force.t);
  }
  // An arc without force samples has no nodes of its own: add some for the trajectory plot.
  const bool bare = force_times.empty() && !data.passes.empty();
  for (TimeNs t = bare ? data.passes.back().end : to; t < to; t += kPathStep) {
    if (t >= from) times.push_back(t);
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return std::make_unique<Segment>(track, from, times, force_times, scaling, max_block);
}

std::vector<TimeNs> EvenKnots(TimeNs from, TimeNs to, double interval) {
  const TimeNs length = to - from;
  const int count = std::max(1, static_cast<int>(std::ceil(ToSeconds(length) / interval)));
  std::vector<TimeNs> knots;
  for (int k = 0; k <= count; ++k) knots.push_back(from + length * k / count);
  return knots;
}

// A negligible floor keeps the covariance regular if a process is switched off: 1 mm, 1 mm/s,
// 0.0006 deg.
ContinuityResidual::Weights StepWeights(const ProcessNoise& noise,
                                        const Eigen::Vector3d& drift_unit, const Segment& segment,
                                        double gravity) {
  const double seconds = SecondsBetween(segment.start(), segment.end());
  Matrix9d cov = ProcessCovariance(noise, seconds, gravity, segment.thrust_axis());
  cov.diagonal().head<6>().array() += 1e-6;
  cov.diagonal().tail<3>().array() += 1e-10;
  const Matrix9d L = cov.llt().matrixL();
  return {drift_unit, noise.Decay(seconds),
          L.triangularView<Eigen::Lower>().solve(Matrix9d::Identity()), noise.GustDecay(seconds),
          noise.gust > 0.0 ? 1.0 / noise.GustStepSigma(seconds) : 0.0};
}

double LogDeterminant(const ContinuityResidual::Weights& weights, bool gusts) {
  // Of a triangular matrix.
  const double path = weights.sqrt_information.diagonal().array().log().sum();
  return gusts ? path + kGustSize * std::log(weights.gust_weight) : path;
}

}  // namespace trueline
