#include <Eigen/Geometry>
#include <array>

#include "problems/common/error.h"
#include "problems/simulators/vehicle_file.h"

namespace trueline {
namespace {

using Pose = Eigen::Isometry3d;

// Mass and inertia of a link in the model's frame (forward-left-up), and where they stand.
struct Link {
  std::string name;
  std::size_t file;
  const FileNode* inertial;
  double mass;
  Eigen::Vector3d centre;        // m
  Eigen::Matrix3d inertia;       // kg m^2, about its centre
  Pose pose = Pose::Identity();  // of the link
};

double Number(const ParameterFile& file, const FileNode* from, const std::string& where) {
  const FileNode* leaf = from != nullptr ? file.Find(*from, where) : nullptr;
  return leaf == nullptr || leaf->text.empty() ? 0.0 : file.NumberOf(*leaf);
}

// Six numbers: x y z roll pitch yaw.
Pose PoseFrom(const std::array<double, 6>& p) {
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(p[0], p[1], p[2]);
  pose.linear() = (Eigen::AngleAxisd(p[5], Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(p[4], Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(p[3], Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  return pose;
}

// <pose> of SDF, or <origin xyz rpy> of URDF, in an element.
Pose PoseIn(const ParameterFile& file, const FileNode* element, bool urdf) {
  std::array<double, 6> p{};
  const FileNode* pose = urdf ? nullptr : element->Child("pose");
  for (const FileNode& said : pose != nullptr ? pose->children : std::vector<FileNode>()) {
    const bool usual = said.text.empty() || said.text == "__model__" || said.text == "false" ||
                       said.text == "euler_rpy";
    if (usual) continue;
    throw ErrorAt(file.path().string(), said.place.line,
                  "pose " + said.name.substr(1) + "='" + said.text +
                      "': poses are read in the model's frame and in radians only; write it so");
  }
  for (int i = 0; i < 6; ++i) {
    const std::string part = i < 3 ? "origin/@xyz/" : "origin/@rpy/";
    const std::string where = urdf ? part + std::to_string(i % 3) : "pose/" + std::to_string(i);
    p[static_cast<std::size_t>(i)] = Number(file, element, where);
  }
  return PoseFrom(p);
}

// Of a URDF's link: that of its parent, then the joint's.
Pose JointPose(const ParameterFile& file, const std::string& link, int depth) {
  constexpr int kDeepest = 50;
  for (const FileNode* joint : file.All("joint")) {
    const FileNode* child = file.Find(*joint, "child/@link");
    const FileNode* parent = file.Find(*joint, "parent/@link");
    if (child == nullptr || parent == nullptr || child->text != link || depth > kDeepest) continue;
    return JointPose(file, parent->text, depth + 1) * PoseIn(file, joint, true);
  }
  return Pose::Identity();
}

constexpr std::array<std::array<int, 2>, 6> kElements = {
    {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
constexpr std::array<const char*, 6> kInFile = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};
constexpr std::array<const char*, 6> kNames = {"I_x", "I_y", "I_z", "I_xy", "I_xz", "I_yz"};
// From forward-left-up to forward-right-down.
constexpr std::array<double, 6> kFlip = {1.0, 1.0, 1.0, -1.0, -1.0, 1.0};

std::vector<Link> LinksOf(const VehicleFile& vehicle, bool urdf) {
  std::vector<Link> links;
  for (std::size_t f = 0; f < vehicle.files.size(); ++f) {
    const ParameterFile& file = *vehicle.files[f];
    for (const FileNode* node : file.All("link")) {
      const FileNode* inertial = node->Child("inertial");
      if (inertial == nullptr) continue;
      const FileNode* name = node->Child("@name");
      Link link{name != nullptr ? name->text : "", f, inertial, 0.0, {}, {}};
      link.mass = Number(file, inertial, urdf ? "mass/@value" : "mass");
      link.pose = urdf ? JointPose(file, link.name, 0) : PoseIn(file, node, false);
      const Pose at = link.pose * PoseIn(file, inertial, urdf);
      link.centre = at.translation();
      for (std::size_t k = 0; k < 6; ++k) {
        const auto [i, j] = kElements[k];
        link.inertia(i, j) = link.inertia(j, i) = Number(
            file, inertial,
            urdf ? std::string("inertia/@") + kInFile[k] : std::string("inertia/") + kInFile[k]);
      }
      link.inertia = at.linear() * link.inertia * at.linear().transpose();
      links.push_back(link);
    }
  }
  return links;
}

// Steiner: the inertia about a point at `r` from the centre.
Eigen::Matrix3d Moved(double mass, const Eigen::Vector3d& r) {
  return mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
}

// m, mean horizontal distance from `centre` of the links that joints let turn; 0 where fewer than
// three do. A model whose motors stand in another file has its rotors there.
double ArmOf(const VehicleFile& vehicle, const std::vector<Link>& links,
             const Eigen::Vector3d& centre) {
  double sum = 0.0;
  int count = 0;
  for (const auto& file : vehicle.files) {
    for (const FileNode* joint : file->All("joint")) {
      const FileNode *type = joint->Child("@type"),
                     *child = file->Find(*joint, "child/@link|child");
      if (type == nullptr || child == nullptr) continue;
      if (type->text != "revolute" && type->text != "continuous") continue;
      for (const Link& link : links) {
        if (link.name != child->text) continue;
        sum += (link.centre - centre).head<2>().norm(), ++count;
      }
    }
  }
  return count < 3 ? 0.0 : sum / count;
}

// Of the heaviest link. The fields are the same for all models of a kind.
std::vector<FileField> FieldsOfBase(bool urdf) {
  std::vector<FileField> fields = {{"m", urdf ? "mass/@value" : "mass"}};
  for (std::size_t k = 0; k < 6; ++k) {
    fields.push_back(
        {kNames[k], (urdf ? "inertia/@" : "inertia/") + std::string(kInFile[k]), {kFlip[k]}});
  }
  constexpr std::array<const char*, 3> kCentre = {"r_BM_x", "r_BM_y", "r_BM_z"};
  for (std::size_t i = 0; i < 3; ++i) {
    fields.push_back(
        {kCentre[i], (urdf ? "origin/@xyz/" : "pose/") + std::to_string(i), {i == 0 ? 1.0 : -1.0}});
  }
  return fields;
}

}  // namespace

void AddLinks(VehicleFile* file) {
  const bool urdf = file->target->links == LinkKind::kUrdf;
  const std::vector<Link> links = LinksOf(*file, urdf);
  double mass = 0.0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  const Link* base = nullptr;
  for (const Link& link : links) {
    mass += link.mass;
    moment += link.mass * link.centre;
    if (base == nullptr || link.mass > base->mass) base = &link;
  }
  if (base == nullptr) return;
  const bool heavy = mass > 0.0;  // else the mass alone is read, to be named
  const Eigen::Vector3d centre = heavy ? Eigen::Vector3d(moment / mass) : moment;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  for (const Link& link : links) inertia += link.inertia + Moved(link.mass, link.centre - centre);

  static const std::vector<FileField> sdf_fields = FieldsOfBase(false);
  static const std::vector<FileField> urdf_fields = FieldsOfBase(true);
  NeutralVehicle& v = file->vehicle;
  if (const double arm = ArmOf(*file, links, centre); arm > 0.0) v.body["link_arm"] = arm;
  const ParameterFile& text = *file->files[base->file];
  for (const FileField& field : urdf ? urdf_fields : sdf_fields) {
    const std::string name = field.name;
    double value = mass, own = base->mass, scale = 1.0;
    if (name.starts_with("I_")) {
      const auto k =
          static_cast<std::size_t>(std::find(kNames.begin(), kNames.end(), name) - kNames.begin());
      const auto [i, j] = kElements[k];
      value = kFlip[k] * inertia(i, j), own = kFlip[k] * base->inertia(i, j);
    } else if (name.starts_with("r_BM")) {
      const int axis = name.back() - 'x';
      const double sign = axis == 0 ? 1.0 : -1.0;
      scale = base->mass / mass;
      value = sign * centre[axis];
      own = sign * (base->centre - base->pose.translation())[axis];
    }
    const FileNode* leaf = text.Find(*base->inertial, field.path);
    if (!heavy && (name != "m" || leaf == nullptr)) continue;
    v.body[name] = value;
    if (leaf == nullptr || leaf->text.empty()) continue;
    Reading reading{&field, -1, base->file, text.PlainNumber(*leaf)};
    reading.number = text.NumberOf(*leaf);
    reading.value = value;
    reading.scale = scale;
    reading.offset = value - scale * own;
    reading.key = "link[name=" + base->name + "]/inertial/" + field.path;
    file->readings.push_back(reading);
  }
}

}  // namespace trueline
