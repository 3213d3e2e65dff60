// Differences between the streams of a log and mocap, without the model of the vehicle: they are
// zero, but for noise and constant offsets, where the stream agrees with mocap.
#pragma once

#include <optional>
#include <vector>

#include "problems/effects/effect.h"

namespace trueline {

inline constexpr double kAttitudeSpacing = 0.02;  // s, between attitudes compared

// Three rows for each sample, and the columns of what an agreeing stream may still differ by:
// turned frames, biases.
struct StreamRows {
  std::vector<double> t;      // s, by sample
  Eigen::VectorXd r;          // rad, m/s^2 or stated sigmas of a fix; in E
  Eigen::MatrixXd nuisances;  // rows x offsets
};

// Compares logs that were corrected for effects, each with the samples of the log it was made for.
class MocapComparison {
 public:
  // `log` must outlive this object.
  explicit MocapComparison(const FlightLog& log);

  // False if mocap repeats the logged attitude, as a log of positions alone may.
  bool HasOwnAttitude() const { return own_attitude_; }
  // Velocities along mocap's path, every 0.1 s.
  const std::vector<VelocitySample>& path() const { return path_; }

  // The log with its fixes on mocap's path.
  FlightLog WithFixesOnPath() const;

  // Rotation of the logged attitude against mocap's, rad. Offsets: a rotation in E and one in I.
  StreamRows Attitude(const FlightLog& corrected) const;
  // The accelerometer's reading in E, gravity removed, less the second derivative of mocap's
  // positions, both smoothed by the same kernel. Mocap's attitude turns the reading, or the logged
  // one if mocap has none of its own. Offsets: a bias, a rotation in I and one in E; with the
  // logged attitude also a scale.
  StreamRows Acceleration(const FlightLog& corrected) const;
  // Fixes of gates less mocap's position, in stated sigmas. Offsets: shift and heading of the map.
  StreamRows Fixes(const FlightLog& corrected) const;

 private:
  struct Window {
    TimeNs middle;
    Eigen::Vector3d a_E;  // m/s^2, of mocap
  };

  bool Covers(TimeNs from, TimeNs to) const;
  // Null if mocap holds no pose at t.
  std::optional<PoseSample> PoseAt(TimeNs t) const;
  Eigen::Vector3d SecondDerivative(TimeNs middle) const;
  void FindWindows();
  void AlignHeadings();
  std::vector<Eigen::Quaterniond> AttitudesOfImu(const FlightLog& corrected) const;
  void RemoveHeight(StreamRows* rows) const;

  const FlightLog& log_;
  struct Gap {
    TimeNs from, to;  // the samples around it
  };
  std::vector<Gap> gaps_;
  double reach_ = 0.0;  // s, half the kernel's width
  bool has_height_ = true, own_attitude_ = false;
  Eigen::Quaterniond q_E_Ep_ = Eigen::Quaterniond::Identity();  // of the logged attitude, roughly
  std::vector<std::size_t> attitude_, fixes_;                   // samples compared
  std::vector<Window> windows_;
  std::vector<VelocitySample> path_;
};

}  // namespace trueline
