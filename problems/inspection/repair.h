// What a corrected map changes, and the same changes of a log in memory.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "problems/import/frames.h"
#include "problems/log/flight_log.h"

namespace trueline {

bool IsIdentity(const Eigen::Matrix3d& m);  // but for rounding

// Of one stream, in native axes; the identity unless stated.
struct StreamRepair {
  double time_offset = 0.0;  // s, added to the stamps
  // The right quaternion's w, x, y, z are these components as the file has them; then its inverse.
  std::array<int, 4> quaternion = {0, 1, 2, 3};
  bool inverse = false;
  // q becomes earth q body^T, a position `position` p. Rotations.
  Eigen::Matrix3d earth = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d body = Eigen::Matrix3d::Identity();
  // Orthogonal, also left-handed: accel becomes accel_scale accel a, and so on.
  Eigen::Matrix3d accel = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d gyro = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d position = Eigen::Matrix3d::Identity();
  double accel_scale = 1.0, gyro_scale = 1.0, position_scale = 1.0;
  double channel_scale = 1.0;  // of rotor speeds
  // Channel i of the right stream is channel order[i] of this one; empty: as it is.
  std::vector<std::size_t> order = {};
  // Before all that: rows of these times, and rows that repeat the one before, are left out.
  std::vector<std::pair<TimeNs, TimeNs>> leave_out = {};
  bool only_new = false;

  bool IsNone() const;
};

struct Repairs {
  std::map<std::string, StreamRepair> streams;  // by name
  bool reverse_spins = false;                   // of all rotors of the vehicle

  bool IsNone() const;
};

// How the file states an attitude. The order of a quaternion's components is that in the file's
// axes.
struct FileAttitude {
  SourceAxes axes;
  bool is_quaternion = true;  // otherwise Euler angles
};
// By stream; NED, FRD and a quaternion where none is stated.
using FileAttitudes = std::map<std::string, FileAttitude>;

// The quaternion that the file's components mean when they are read as `repair` says.
Eigen::Quaterniond Reread(const Eigen::Quaterniond& q, const StreamRepair& repair,
                          const SourceAxes& axes);

void ApplyRepairs(const Repairs& repairs, const FileAttitudes& sources, FlightLog* log);

}  // namespace trueline
