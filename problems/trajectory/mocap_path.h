// Position and velocity along a mocap record, and fixes sampled from it.
#pragma once

#include <optional>
#include <vector>

#include "problems/common/random.h"
#include "problems/log/flight_log.h"
#include "problems/trajectory/straight.h"

namespace trueline {

// Velocity at each sample (m/s, E): difference over the samples within +-`half_window`, at least
// over the neighbours. The usual span suppresses position noise of millimetres.
std::vector<Eigen::Vector3d> PathVelocity(const std::vector<PoseSample>& mocap,
                                          TimeNs half_window = kNsPerSecond / 10);

inline constexpr double kMocapGap = 0.2;  // s, across which a path is known from its ends

// Position at `t` (m, E), linear between the neighbouring samples. Nothing outside the record, or
// where the neighbours are further apart than `max_gap` (s).
std::optional<Eigen::Vector3d> PositionAt(const std::vector<PoseSample>& mocap, TimeNs t,
                                          double max_gap = kMocapGap);

// Gate detections sampled from ground truth (Li et al. 2019, eq. 33), for logs without a detector,
// for the simulator and for benchmarks.
struct FixSamplerOptions {
  int min_count = 15;          // fixes on a straight; the number is drawn evenly from
  int max_count = 20;          // min_count .. max_count
  double sigma_factor = 0.1;   // sigma of an axis over the distance to the gate
  double sigma_floor = 0.05;   // m, the least sigma
  double student_dof = 0.0;    // degrees of freedom of heavy tails; 0: Gaussian
  double outlier_share = 0.0;  // of fixes whose error is independent of their sigma
  double outlier_size = 2.0;   // m, standard deviation of an outlier's error on each axis
  double max_gap = 0.2;        // s; no fix where mocap samples are further apart

  // Throws InputError naming an option out of range.
  void Check() const;
};

// P_i = p(t_i) + N(0, sigma_i^2 I) at random times on each straight, sigma_i = max(sigma_floor,
// sigma_factor * |p(t_i) - gate|), in the order of time. The `sigma` of a fix is this scale, also
// if the tails are heavy or the fix is an outlier: a detector cannot know.
std::vector<Fix> SampleFixes(const std::vector<PoseSample>& mocap,
                             const std::vector<Straight>& straights,
                             const FixSamplerOptions& options, Random& random);

}  // namespace trueline
