// Source of a native quantity: columns or constants, units, scale, offset, axes.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/strict_yaml.h"
#include "problems/import/foreign_csv.h"
#include "problems/log/units.h"

namespace trueline {

// Axes of foreign logs, as rotations to the native ones.

// From the source's axes to NED and to FRD; rotations but for a left-handed `matrix`.
struct SourceAxes {
  Eigen::Matrix3d earth = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d body = Eigen::Matrix3d::Identity();
};

// The keys `earth` and `body` of `map`; a missing one keeps the value of `fallback`.
//
//   earth: NED | ENU | NWU (z up, x is north) | {axes: [z, -x, -y], yaw_deg: 33}
//   body:  FRD | FLU | {axes: [x, -y, -z]}
//
// `axes` states which of the source's axes is the native first, second and third one. `yaw_deg`
// then rotates the earth about down: v_E = Rz(yaw) v. Axes must be right-handed. `matrix: [[...],
// [...], [...]]` is then applied: any orthogonal one, for vectors also left-handed.
SourceAxes ReadAxes(const YamlMap& map, const SourceAxes& fallback);

// The mapping that ReadAxes reads as `axes`.
YAML::Node AxesNode(const Eigen::Matrix3d& axes);

// One column, by name or by number from 1, or a constant: `px`, `19`, `{constant: -1.5}`.
class SourceColumn {
 public:
  SourceColumn() = default;
  explicit SourceColumn(double constant) : constant_(constant) {}
  SourceColumn(const YAML::Node& node, const std::string& map_file);

  void Bind(const ForeignRow& row);
  double Value(const ForeignRow& row) const;  // not a number where it is missing
  bool is_constant() const { return constant_.has_value(); }
  const std::optional<double>& constant() const { return constant_; }
  int index() const { return index_; }

 private:
  std::string name_;
  std::string where_;  // file:line of the map, for errors
  std::optional<double> constant_;
  int index_ = -1;
};

// "name[0..2]" as the list name[0], name[1], name[2]; any other node as it is.
YAML::Node ExpandColumns(const YAML::Node& columns);

// `keys: [a, b, c]` as columns; `count` of them, or any number for 0. "q[0..3]" stands for q[0],
// q[1], q[2], q[3].
std::vector<SourceColumn> ReadColumns(const YamlMap& map, const std::string& key, int count);

// The factor of the map's `unit` (default: `si`) to the SI unit `si`.
double ReadUnit(const YamlMap& map, const char* si);

// Numbers in SI = scale * unit * column + offset, in any number of columns:
// {columns: [a, b, c], unit: u, scale: s or [s, s, s], offset: likewise}. Any number of columns may
// have `mix: [[1, 0.5], ...]`: a row of weights of the columns for each number.
class NumberSource {
 public:
  NumberSource() = default;
  explicit NumberSource(double constant)
      : columns_{SourceColumn(constant)}, scale_{1}, offset_{0} {}
  // `si` is the SI unit; `count` the number of columns, or 0 for any.
  NumberSource(const YamlMap& map, const char* si, int count, const char* key = "columns");
  // A single column: {column: c, unit: u, scale: s, offset: o} or {constant: c}.
  static NumberSource Single(const YamlMap& map, const char* si);

  void Bind(const ForeignRow& row);
  std::vector<double> Values(const ForeignRow& row) const;
  std::optional<double> Constant() const;  // a single constant's value, in SI
  int index(std::size_t i = 0) const { return columns_[i].index(); }

 private:
  std::vector<SourceColumn> columns_;
  std::vector<double> scale_;
  std::vector<double> offset_;
  std::vector<std::vector<double>> mix_;  // rows of weights; none: the columns themselves
};

// The orders in which three angles about x, y and z turn, "zyx" first: its rotation is Rz Ry Rx,
// that of yaw, pitch and roll. "vector": they are one rotation vector.
const std::vector<std::string>& AngleOrders();
Eigen::Quaterniond TurnBy(const Eigen::Vector3d& angles, const std::string& order);
Eigen::Vector3d AnglesOf(const Eigen::Quaterniond& q, const std::string& order);

// quaternion: {w: c, x: c, y: c, z: c, scale: s}, or euler: {roll: c, pitch: c, yaw: c, unit: rad,
// scale: s or [s, s, s], order: zyx}, or matrix: {columns: [9 of them]}, row by row. With `inverse:
// true` beside the columns they are the rotation from earth to body. Otherwise the file's rotation
// is from the source's body to its earth; Value() returns that from FRD to NED.
class SourceAttitude {
 public:
  SourceAttitude() = default;
  const SourceAxes& axes() const { return axes_; }
  // "quaternion", "matrix", or of angles their order.
  const std::string& form() const { return order_.empty() ? form_ : order_; }
  // Reads the keys `quaternion`, `euler` or `matrix`, `earth`, `body` of `map`.
  SourceAttitude(const YamlMap& map, const SourceAxes& axes);

  void Bind(const ForeignRow& row);
  bool HasAny(const ForeignRow& row) const;  // a number in one of its columns
  // No value if a column is missing, the quaternion is zero, or its norm is not 1 (a matrix: it is
  // no rotation); `bad_norm` is set to that norm, or to the determinant's cubic root.
  std::optional<Eigen::Quaterniond> Value(const ForeignRow& row,
                                          std::optional<double>* bad_norm) const;
  // The error for a row with such a norm.
  InputError NormError(const ForeignRow& row, double norm) const;

 private:
  std::optional<Eigen::Quaterniond> FromQuaternion(const ForeignRow& row,
                                                   std::optional<double>* bad_norm) const;
  std::optional<Eigen::Quaterniond> FromEuler(const ForeignRow& row) const;
  std::optional<Eigen::Quaterniond> FromMatrix(const ForeignRow& row,
                                               std::optional<double>* bad_norm) const;

  std::string form_;   // quaternion, euler or matrix
  std::string order_;  // of angles
  std::vector<SourceColumn> columns_;
  std::vector<double> scale_;  // of the columns, in their order
  bool inverse_ = false;
  SourceAxes axes_;
  Eigen::Quaterniond to_earth_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond from_body_ = Eigen::Quaterniond::Identity();
};

}  // namespace trueline
