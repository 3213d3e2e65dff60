#include "problems/import/frames.h"

#include <Eigen/Dense>
#include <array>
#include <map>
#include <numbers>

#include "problems/common/error.h"

namespace trueline {
namespace {

using Names = std::map<std::string, std::vector<std::string>>;

const Names kEarthFrames = {
    {"NED", {"x", "y", "z"}}, {"ENU", {"y", "x", "-z"}}, {"NWU", {"x", "-y", "-z"}}};
const Names kBodyFrames = {{"FRD", {"x", "y", "z"}}, {"FLU", {"x", "-y", "-z"}}};

Eigen::Matrix3d AxesMatrix(const YamlMap& map, const std::string& key,
                           const std::vector<std::string>& axes) {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();
  if (axes.size() != 3) map.Fail(key, "needs three axes, such as [z, -x, -y]");
  for (Eigen::Index row = 0; row < 3; ++row) {
    std::string axis = axes[static_cast<std::size_t>(row)];
    const double sign = axis.starts_with('-') ? -1.0 : 1.0;
    if (axis.starts_with('-') || axis.starts_with('+')) axis.erase(0, 1);
    if (axis != "x" && axis != "y" && axis != "z") {
      map.Fail(key, fmt::format("'{}' is no axis; use x, y, z, -x, -y or -z", axis));
    }
    rotation(row, axis[0] - 'x') = sign;
  }
  if (std::abs(rotation.determinant() - 1.0) > 1e-9) {
    map.Fail(key, "the axes are not right-handed; check their order and signs");
  }
  return rotation;
}

// Rounded digits are made orthogonal again.
Eigen::Matrix3d ReadMatrix(const YamlMap& map) {
  if (!map.Has("matrix")) return Eigen::Matrix3d::Identity();
  const auto rows = map.Get<std::vector<std::array<double, 3>>>("matrix");
  if (rows.size() != 3) map.Fail("matrix", "needs three rows of three numbers");
  Eigen::Matrix3d matrix;
  for (Eigen::Index row = 0; row < 3; ++row) {
    matrix.row(row) = Eigen::RowVector3d(rows[static_cast<std::size_t>(row)].data());
  }
  if (!(matrix * matrix.transpose()).isIdentity(1e-3)) {
    map.Fail("matrix", "is not orthogonal: its rows must be unit vectors at right angles");
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

Eigen::Matrix3d ReadFrame(const YamlMap& map, const std::string& key, const Names& names,
                          const Eigen::Matrix3d& fallback) {
  const YAML::Node node = map.RawNode(key);
  if (!map.Has(key)) return fallback;
  if (node.IsScalar()) {
    std::vector<std::string> known;
    for (const auto& [name, axes] : names) known.push_back(name);
    return AxesMatrix(map, key, names.at(map.GetChoice(key, known, "")));
  }
  const YamlMap general = map.Child(key);
  const auto axes = general.Get<std::vector<std::string>>("axes");
  const double yaw = general.Get<double>("yaw_deg", 0.0) * std::numbers::pi / 180.0;
  const Eigen::Matrix3d matrix = ReadMatrix(general);
  general.Finish();
  const Eigen::AngleAxisd turn(yaw, Eigen::Vector3d::UnitZ());
  return matrix * turn.toRotationMatrix() * AxesMatrix(general, "axes", axes);
}

}  // namespace

YAML::Node AxesNode(const Eigen::Matrix3d& axes) {
  YAML::Node names, rows, node;
  const Eigen::Matrix3d whole = axes.array().round();
  const bool named = (axes - whole).norm() < 1e-9 && whole.determinant() > 0.5;
  for (Eigen::Index i = 0; i < 3; ++i) {
    Eigen::Index axis = i;
    if (named) whole.row(i).cwiseAbs().maxCoeff(&axis);
    names.push_back(std::string(named && whole(i, axis) < 0.0 ? "-" : "") + "xyz"[axis]);
    YAML::Node row;
    for (Eigen::Index k = 0; k < 3; ++k) row.push_back(fmt::format("{:.9g}", axes(i, k)));
    rows.push_back(row);
  }
  node["axes"] = names;
  if (!named) node["matrix"] = rows;
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

SourceAxes ReadAxes(const YamlMap& map, const SourceAxes& fallback) {
  return {ReadFrame(map, "earth", kEarthFrames, fallback.earth),
          ReadFrame(map, "body", kBodyFrames, fallback.body)};
}

}  // namespace trueline
