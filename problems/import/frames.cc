#include "problems/import/frames.h"

#include <Eigen/Geometry>
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
  general.Finish();
  const Eigen::AngleAxisd turn(yaw, Eigen::Vector3d::UnitZ());
  return turn.toRotationMatrix() * AxesMatrix(general, "axes", axes);
}

}  // namespace

SourceAxes ReadAxes(const YamlMap& map, const SourceAxes& fallback) {
  return {ReadFrame(map, "earth", kEarthFrames, fallback.earth),
          ReadFrame(map, "body", kBodyFrames, fallback.body)};
}

}  // namespace trueline
