// The camera that detects gates, and the conversion of detections to position fixes.
#pragma once

#include <vector>

#include "problems/simulation/flight.h"

namespace trueline::simulation {

// A stretch of flight during which one gate is in view.
struct GateView {
  int gate;           // index into the map
  double start, end;  // s
};

class GateCamera {
 public:
  GateCamera(const DetectorConfig& config, const std::vector<Gate>& map, const Stages& stages,
             std::uint64_t seed);

  // All views within the log's time. If several gates are in view, the nearest one counts.
  std::vector<GateView> Views(const Trajectory& truth) const;
  // Fixes of the log's time, strictly increasing stamps.
  std::vector<Fix> Fixes(const Trajectory& truth);

 private:
  int VisibleGate(const TruthSample& sample) const;  // -1: none
  bool Sees(const TruthSample& sample, int gate) const;
  Fix Measure(const Trajectory& truth, int gate, double t);
  Vector3d Noise(double sigma);

  DetectorConfig config_;
  std::vector<Gate> map_;
  std::vector<Vector3d> standing_;  // true places of the gates, m in E
  const Stages& stages_;
  double latency_;
  Random times_, noise_, outliers_, jitter_, false_gates_;
};

}  // namespace trueline::simulation
