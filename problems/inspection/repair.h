// What a corrected map changes, and the same changes of a log in memory.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "problems/import/source.h"
#include "problems/log/flight_log.h"

namespace trueline {

bool IsIdentity(const Eigen::Matrix3d& m);  // but for rounding

// Rows of a stream, by their stamps.
struct Stretch {
  TimeNs from = 0, until = 0;  // of the first and the last row

  bool Holds(TimeNs t) const { return t >= from && t <= until; }
  double Seconds() const { return SecondsBetween(from, until); }
};
bool IsWithin(const std::vector<Stretch>& stretches, TimeNs t);

// Of one stream, in native axes; the identity unless stated.
struct StreamRepair {
  double time_offset = 0.0;  // s, added to the stamps
  // The right quaternion's w, x, y, z are these components as the file has them; then its inverse.
  std::array<int, 4> quaternion = {0, 1, 2, 3};
  bool inverse = false;
  // The right rotation is that of the file's three angles, each times a factor, in this order (see
  // AngleOrders()); empty: as the file has it.
  std::string angle_order = {};
  Eigen::Vector3d angle_factor = Eigen::Vector3d::Ones();
  // q becomes earth q body^T, a position `position` p. Rotations.
  Eigen::Matrix3d earth = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d body = Eigen::Matrix3d::Identity();
  // Orthogonal, also left-handed: accel becomes accel_scale accel a, and so on.
  Eigen::Matrix3d accel = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d gyro = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d position = Eigen::Matrix3d::Identity();
  double accel_scale = 1.0, gyro_scale = 1.0, position_scale = 1.0;
  // The stream whose attitude makes a specific force of what the accelerometer reads in the earth's
  // axes or with `gravity_removed` (1, or -1 where that earth has z up); empty: it reads one.
  std::string force_by = {};
  bool force_in_earth = false;
  double gravity_removed = 0.0;
  double channel_scale = 1.0;  // of rotor speeds
  // Channel i of the right stream is channel order[i] of this one; empty: as it is.
  std::vector<std::size_t> order = {};
  // Before all that: rows of these times, and rows that repeat the one before, are left out.
  std::vector<Stretch> leave_out = {};
  bool only_new = false;

  bool IsNone() const;
};

// The rotations of a repair, and its scales.
inline constexpr std::array kTurnsOfRepair = {&StreamRepair::earth, &StreamRepair::body,
                                              &StreamRepair::accel, &StreamRepair::gyro,
                                              &StreamRepair::position};
inline constexpr std::array kScalesOfRepair = {
    &StreamRepair::accel_scale, &StreamRepair::gyro_scale, &StreamRepair::position_scale,
    &StreamRepair::channel_scale};

struct Repairs {
  std::map<std::string, StreamRepair> streams;  // by name
  bool reverse_spins = false;                   // of all rotors of the vehicle

  bool IsNone() const;
};

// How the file states an attitude. The order of a quaternion's components is that in the file's
// axes.
struct FileAttitude {
  SourceAxes axes;
  std::string form = "quaternion";  // or as SourceAttitude::form() says
  bool is_beside_imu = false;       // in the same rows

  bool HasAngles() const { return form != "quaternion" && form != "matrix"; }
};
// By stream; NED, FRD and a quaternion where none is stated.
using FileAttitudes = std::map<std::string, FileAttitude>;

// The quaternion that the file's components or angles mean when they are read as `repair` says.
Eigen::Quaterniond Reread(const Eigen::Quaterniond& q, const StreamRepair& repair,
                          const FileAttitude& file);

// Takes numbers that were read in the body's axes to the earth of a stream's attitude, as they are
// if the file states them in the earth's.
Eigen::Matrix3d EarthFromBodyAsRead(const FileAttitudes& sources, const std::string& stream);

void ApplyRepairs(const Repairs& repairs, const FileAttitudes& sources, FlightLog* log);
void ApplyRepair(const std::string& stream, const StreamRepair& repair,
                 const FileAttitudes& sources, FlightLog* log);

}  // namespace trueline
