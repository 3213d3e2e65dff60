#include "problems/simulators/vehicle_file.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "problems/common/app.h"
#include "problems/common/error.h"

namespace trueline {
namespace {

constexpr int kMostRotors = 16;

// "a{i}" for rotor 2 -> "a2"; {r} counts from 1, {p,q,...} lists names, {./x} is the text of x in
// the rotor's element.
std::string PathOf(const std::string& path, int rotor, const FileNode* element) {
  std::string result = path;
  for (std::size_t open; (open = result.find('{')) != std::string::npos;) {
    const std::size_t close = result.find('}', open);
    const std::string inside = result.substr(open + 1, close - open - 1);
    std::string text;
    if (inside == "i") {
      text = std::to_string(rotor);
    } else if (inside == "r") {
      text = std::to_string(rotor + 1);
    } else if (inside.starts_with("./")) {
      const FileNode* leaf = element != nullptr ? element->Child(inside.substr(2)) : nullptr;
      text = leaf != nullptr ? leaf->text : "";
    } else {
      const std::vector<std::string> names = SplitList(inside);
      text = rotor < static_cast<int>(names.size()) ? names[static_cast<std::size_t>(rotor)] : "-";
    }
    result.replace(open, close + 1 - open, text);
  }
  return result;
}

struct RotorElement {
  const ParameterFile* file;
  const FileNode* node;
  double number;
};

// What reads one vehicle.
class Reader {
 public:
  Reader(VehicleFile* to, std::string table) : to_(to), table_(std::move(table)) { FindElements(); }

  void Read() {
    const Target& target = *to_->target;
    to_->vehicle.gravity = target.gravity;
    if (target.by_thrust) to_->vehicle.body["full_speed"] = kSpeedOfThrust;
    to_->vehicle.rotors.resize(static_cast<std::size_t>(CountRotors()));
    if (target.links != LinkKind::kNone) AddLinks(to_);
    for (const FileField& field : target.fields) {
      if (!field.OfRotor()) {
        Add(field, -1, nullptr);
        continue;
      }
      for (int i = 0; i < static_cast<int>(to_->vehicle.rotors.size()); ++i)
        Add(field, i, Element(i));
    }
  }

 private:
  static constexpr double kSpeedOfThrust = 1000.0;  // rad/s, at full command of thrusts

  void FindElements() {
    const Target& target = *to_->target;
    if (target.rotor_elements.empty()) return;
    for (const auto& file : to_->files) {
      for (const FileNode* node : file->All(target.rotor_elements)) {
        const FileNode* number = file->Find(*node, target.rotor_number);
        if (number != nullptr) elements_.push_back({file.get(), node, file->NumberOf(*number)});
      }
    }
    std::stable_sort(elements_.begin(), elements_.end(),
                     [](const auto& a, const auto& b) { return a.number < b.number; });
  }
  const FileNode* Element(int rotor) const {
    return elements_.empty() ? nullptr : elements_[static_cast<std::size_t>(rotor)].node;
  }
  int CountRotors() const {
    const Target& target = *to_->target;
    if (!target.rotor_elements.empty()) return static_cast<int>(elements_.size());
    const auto has = [&](const FileField& field, int rotor) {
      return std::ranges::any_of(to_->files, [&](const auto& file) {
        return file->Find(table_ + PathOf(field.path, rotor, nullptr)) != nullptr;
      });
    };
    int count = 0;
    for (const FileField& field : target.fields) {
      if (!field.OfRotor()) continue;
      int of_field = 0;
      while (of_field < kMostRotors && has(field, of_field)) ++of_field;
      count = std::max(count, of_field);
    }
    // An allocation matrix is one list of rows.
    const auto fixed = static_cast<int>(target.order.size());
    return fixed > 0 ? fixed : count;
  }

  void Add(const FileField& field, int rotor, const FileNode* element) {
    const std::string path = PathOf(field.path, rotor, element);
    for (std::size_t i = 0; i < to_->files.size(); ++i) {
      const ParameterFile& file = *to_->files[i];
      const FileNode* leaf = nullptr;
      if (path.starts_with("./")) {
        if (elements_[static_cast<std::size_t>(rotor)].file == &file) {
          leaf = file.Find(*element, path.substr(2));
        }
      } else {
        leaf = file.Find(table_.empty() ? path : table_ + path);
      }
      if (leaf == nullptr || leaf->text.empty()) continue;
      Reading reading{&field, rotor, i, leaf};
      reading.key = path;
      if (std::string(field.name) == "spin" && std::isalpha(leaf->text[0]) != 0) {
        reading.number = leaf->text == "ccw" ? -1.0 : 1.0;
        reading.value = reading.number;
      } else {
        reading.number = file.NumberOf(*leaf);
        reading.leaf = file.PlainNumber(*leaf);
        reading.value = field.unit.FromFile(reading.number, to_->vehicle, rotor);
      }
      if (!field.again) to_->vehicle.Set(field.name, rotor, reading.value);
      to_->readings.push_back(reading);
      return;
    }
  }

  VehicleFile* to_;
  std::string table_;
  std::vector<RotorElement> elements_;
};

// Places and spins that the simulator's code fixes, where the file states none.
void AddFixedOrder(VehicleFile* file) {
  NeutralVehicle& v = file->vehicle;
  const std::vector<FixedRotor> order = OrderOf(*file);
  const double arm = v.Get("arm") / std::sqrt(2.0);
  const auto lever = [&](const char* name) {
    return v.States(name) ? v.Get(name) : v.States("lever") ? v.Get("lever") : arm;
  };
  const double x = lever("lever_x"), y = lever("lever_y");
  for (std::size_t i = 0; i < std::min(order.size(), v.rotors.size()); ++i) {
    v.rotors[i].try_emplace("spin", order[i].spin);
    if (x > 0.0) v.rotors[i].try_emplace("x", order[i].x * x);
    if (y > 0.0) v.rotors[i].try_emplace("y", order[i].y * y);
  }
  // From here on they follow from the rotors.
  for (const char* name : {"arm", "lever", "lever_x", "lever_y"}) v.body.erase(name);
  for (std::size_t i = 0; i < v.rotors.size(); ++i) {
    Numbers& rotor = v.rotors[i];
    if (!rotor.contains("radius") || !rotor.contains("angle")) continue;
    rotor["x"] = rotor["radius"] * std::cos(rotor["angle"]);
    rotor["y"] = rotor["radius"] * std::sin(rotor["angle"]);
    rotor.erase("radius"), rotor.erase("angle");
  }
}

// Rotors that stand beside the body's mass in a RotorS file add to its inertia, too.
void AddRotorMasses(VehicleFile* file) {
  NeutralVehicle& v = file->vehicle;
  const double mass = v.Get("raw_rotor_mass");
  if (mass == 0.0) return;
  for (Reading& reading : file->readings) {
    const std::string name = reading.field->name;
    if (!name.starts_with("I_")) continue;
    const char axis = name[2];
    for (const Numbers& r : v.rotors) {
      for (const char* other : {"x", "y", "z"}) {
        if (other[0] == axis || !r.contains(other)) continue;
        reading.offset += mass * r.at(other) * r.at(other);
      }
    }
    reading.value += reading.offset;
    v.body[name] = reading.value;
  }
}

// AirSim states the sides of a box and the mass of its motors, which give the inertia.
void TakeInertiaOfBox(VehicleFile* file) {
  NeutralVehicle& v = file->vehicle;
  if (!v.States("box_x")) return;
  const double body = v.Get("m") - v.Get("n") * v.Get("raw_motor_mass");
  const Eigen::Vector3d sides(v.Get("box_x"), v.Get("box_y"), v.Get("box_z"));
  for (int axis = 0; axis < 3; ++axis) {
    const double across = sides.squaredNorm() - sides[axis] * sides[axis];
    v.body[std::string("I_") + "xyz"[axis]] = body / 12.0 * across + v.InertiaOfMotors(axis);
  }
  for (const char* name : {"box_x", "box_y", "box_z"}) v.body.erase(name);
}

VehicleFile ReadOne(const Target& target, std::vector<std::shared_ptr<const ParameterFile>> files,
                    const std::string& table) {
  VehicleFile file{&target, std::move(files), {}, {}};
  file.vehicle.name = table;
  Reader(&file, table.empty() ? "" : table + "/").Read();
  AddFixedOrder(&file);
  LineariseAt(0.0, &file);
  AddRotorMasses(&file);
  TakeInertiaOfBox(&file);
  return file;
}

// "*/x": in an entry of the file.
bool HasMark(const ParameterFile& file, const std::string& mark) {
  if (!mark.starts_with("*/")) return file.Find(mark) != nullptr;
  return std::ranges::any_of(file.root().children, [&](const FileNode& table) {
    return file.Find(table, mark.substr(2)) != nullptr;
  });
}

const Target& TargetOf(const ParameterFile& file) {
  for (const Target& target : Targets()) {
    if (HasMark(file, target.mark)) return target;
  }
  std::string names;
  for (const Target& target : Targets()) names += (names.empty() ? "" : ", ") + target.name;
  throw ErrorAt(file.path().string(), 0,
                "is no parameter file that is known (" + names +
                    "); compare by logs with --simulator_log instead");
}

// True if `b` states what `a` lacks of the same vehicle.
bool Completes(const VehicleFile& a, const VehicleFile& b) {
  const std::string &x = a.target->name, &y = b.target->name;
  if (x == "pyflyt") return y == "urdf";
  if (x == "rotors") return y == "rotors_controller";
  const bool gazebo = (x == "gz" || x == "px4_classic") && y == "gz";
  return gazebo && (a.vehicle.rotors.empty() != b.vehicle.rotors.empty() ||
                    a.vehicle.States("m") != b.vehicle.States("m"));
}

// A file of which nothing is read is not one of which all is right.
void RequireNumbers(const VehicleFile& file) {
  if (!file.readings.empty() || file.vehicle.States("m")) return;
  throw ErrorAt(file.files.front()->path().string(), 0,
                "states no mass, inertia, place or thrust of a vehicle where " + file.target->name +
                    " has them; give the file of the vehicle's model");
}

// Digits that no simulator's double lacks; a point, so that YAML 1.1 reads a number.
std::string NumberText(double value, int digits) {
  std::string text = fmt::format("{:.{}g}", value == 0.0 ? 0.0 : value, digits);  // no -0
  const std::size_t e = text.find('e');
  if (text.find('.') == std::string::npos)
    text.insert(e == std::string::npos ? text.size() : e, ".0");
  return text;
}

// The number that a file states for `vehicle`. Terms of a polynomial keep their proportions.
double FileNumber(const Reading& reading, const VehicleFile& file, const NeutralVehicle& vehicle) {
  const std::string name = reading.field->name;
  const auto ratio = [&](const char* of) { return vehicle.Get(of) / file.vehicle.Get(of); };
  const bool polynomial = file.Find("k_f_1") != nullptr && file.Find("k_f_1")->number != 0.0;
  if (polynomial && name.starts_with("k_f")) return reading.number * ratio("k_f");
  if (polynomial && name.starts_with("k_m")) {
    return reading.number * ratio("k_m") / (file.Find("k_m_1") ? 1.0 : ratio("k_f"));
  }
  if (name.starts_with("rise")) return reading.number / ratio("tau");
  if (name.starts_with("fall")) return reading.number / ratio("tau_down");
  const double value = vehicle.Get(name, reading.rotor);
  return reading.field->unit.ToFile((value - reading.offset) / reading.scale, vehicle,
                                    reading.rotor);
}

// Which parameter of NeutralInfo a field states.
bool States(const std::string& field, const std::string& parameter) {
  if (field == parameter) return true;
  if (field == "body_mass") return parameter == "m";
  if (parameter == "arm") {
    constexpr std::string_view kPlaces[] = {"x",     "y",       "x_M",     "y_M",
                                            "lever", "lever_x", "lever_y", "radius"};
    return std::ranges::find(kPlaces, field) != std::end(kPlaces);
  }
  // Places that count from the centre of mass move with it.
  if (field.ends_with("_M")) return parameter == std::string("r_BM_") + field[0];
  if (field == "spin_k_m") return parameter == "k_m";
  if (field == "K" || field == "c") return parameter.starts_with(field + "_");
  if (field.starts_with("rise")) return parameter == "tau";
  if (field.starts_with("box_")) return parameter.starts_with("I_") && parameter[2] != field[4];
  if (field.starts_with("fall")) return parameter == "tau" || parameter == "tau_down";
  if (field == "tau_down") return parameter == "tau";
  return (field.starts_with("k_f_") && parameter == "k_f") ||
         (field.starts_with("k_m_") && parameter == "k_m");
}

// The texts of the files with what `text_of` gives in the places of the readings; "": as it is.
template <class Text>
std::vector<std::string> WithTexts(const VehicleFile& file, const Text& text_of) {
  std::vector<std::vector<FileEdit>> edits(file.files.size());
  for (const Reading& reading : file.readings) {
    const std::string text = reading.leaf != nullptr ? text_of(reading) : "";
    if (!text.empty()) edits[reading.file].push_back({reading.leaf->place, text});
  }
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < edits.size(); ++i) {
    texts.push_back(Edited(file.files[i]->text(), edits[i]));
  }
  return texts;
}

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
  constexpr int kDeepestJoint = 50;
  for (const FileNode* joint : file.All("joint")) {
    const FileNode* child = file.Find(*joint, "child/@link");
    const FileNode* parent = file.Find(*joint, "parent/@link");
    if (child == nullptr || parent == nullptr || child->text != link || depth > kDeepestJoint)
      continue;
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
  constexpr std::array<const char*, 3> kCentreNames = {"r_BM_x", "r_BM_y", "r_BM_z"};
  for (std::size_t i = 0; i < 3; ++i) {
    fields.push_back({kCentreNames[i],
                      (urdf ? "origin/@xyz/" : "pose/") + std::to_string(i),
                      {i == 0 ? 1.0 : -1.0}});
  }
  return fields;
}

}  // namespace

std::vector<FixedRotor> OrderOf(const VehicleFile& file) {
  std::vector<FixedRotor> order = file.target->order;
  const auto& mirrored_by = file.target->mirrored;
  const bool mirrored = std::ranges::any_of(file.files, [&](const auto& one) {
    const FileNode* leaf = mirrored_by.first.empty() ? nullptr : one->Find(mirrored_by.first);
    return leaf != nullptr && leaf->text == mirrored_by.second;
  });
  if (mirrored) {
    for (FixedRotor& rotor : order) rotor.y *= -1, rotor.spin *= -1;
  }
  return order;
}

void LineariseAt(double speed, VehicleFile* file) {
  NeutralVehicle& v = file->vehicle;
  const auto stated = [&](const char* name) {
    const Reading* reading = file->Find(name);
    return reading != nullptr ? reading->value : 0.0;
  };
  const double a = stated("k_f"), b = stated("k_f_1"), c = stated("k_f_0");
  if (b != 0.0 || c != 0.0) {
    const auto speed_of = [&](double thrust) {
      return (-b + std::sqrt(b * b - 4.0 * a * (c - thrust))) / (2.0 * a);
    };
    if (speed == 0.0) speed = speed_of(v.Get("m") * v.gravity / v.Get("n"));
    for (const Reading& reading : file->readings) {
      const FileField& field = *reading.field;
      if (field.unit.power == 2.0) v.body[field.name] = speed_of(a * reading.value * reading.value);
    }
    if (speed > 0.0) {
      const auto at_speed = [&](double square, double linear, double constant) {
        return square + linear / speed + constant / (speed * speed);
      };
      v.Set("k_m", -1,
            file->Find("k_m_1") != nullptr
                ? at_speed(stated("k_m"), stated("k_m_1"), stated("k_m_0"))
                : stated("k_m") / a * at_speed(a, b, c));
      v.Set("k_f", -1, at_speed(a, b, c));
    }
  }
  if (file->Find("rise") != nullptr) {
    if (!(speed > 0.0)) speed = v.Get("w_h");
    v.body["tau"] = 1.0 / (stated("rise") + 2.0 * speed * stated("rise_2"));
    v.body["tau_down"] = 1.0 / (stated("fall") + 2.0 * speed * stated("fall_2"));
    for (const char* name : {"rise", "rise_2", "fall", "fall_2"}) v.body.erase(name);
  }
  for (const char* name : {"k_f_1", "k_f_0", "k_m_1", "k_m_0"}) v.body.erase(name);
}

std::string VehicleFile::Name() const {
  std::string name;
  for (const auto& file : files)
    name += (name.empty() ? "" : ", ") + file->path().filename().string();
  return vehicle.name.empty() ? name : name + " [" + vehicle.name + "]";
}

const Reading* VehicleFile::Find(const std::string& name) const {
  for (const Reading& reading : readings) {
    if (name == reading.field->name && !reading.field->again) return &reading;
  }
  for (const Reading& reading : readings) {
    if (States(reading.field->name, name) && !reading.field->again) return &reading;
  }
  return nullptr;
}

std::vector<VehicleFile> ReadVehicleFiles(const std::vector<std::string>& paths) {
  std::vector<VehicleFile> vehicles;
  for (const std::string& path : paths) {
    const auto file = std::make_shared<const ParameterFile>(ParameterFile::Read(path));
    const Target& target = TargetOf(*file);
    std::vector<std::string> tables;
    if (target.tables) {
      for (const FileNode& table : file->root().children) {
        if (file->Find(table, target.mark.substr(2)) != nullptr) tables.push_back(table.name);
      }
    } else {
      tables.emplace_back();
    }
    for (const std::string& table : tables) {
      VehicleFile read = ReadOne(target, {file}, table);
      RequireNumbers(read);
      bool joined = false;
      for (VehicleFile& other : vehicles) {
        const bool first = Completes(other, read);
        if (joined || (!first && !Completes(read, other))) continue;
        auto files = other.files;
        files.push_back(file);
        other = ReadOne(first ? *other.target : target, files, table);
        joined = true;
      }
      if (!joined) vehicles.push_back(std::move(read));
    }
  }
  return vehicles;
}

std::vector<std::string> Corrected(const VehicleFile& file, const NeutralVehicle& vehicle,
                                   const std::vector<std::string>& names) {
  constexpr int kDigits = 6;
  return WithTexts(file, [&](const Reading& reading) -> std::string {
    const bool asked = std::ranges::any_of(
        names, [&](const std::string& name) { return States(reading.field->name, name); });
    if (!asked) return "";
    const double number = FileNumber(reading, file, vehicle);
    const bool same = std::abs(number - reading.number) <= 1e-12 * std::abs(number);
    return same ? "" : NumberText(number, kDigits);
  });
}

VehicleFile ReadVehicleTexts(const Target& target, const std::vector<ParameterFile>& files) {
  std::vector<std::shared_ptr<const ParameterFile>> shared;
  for (const ParameterFile& file : files) {
    shared.push_back(
        std::make_shared<const ParameterFile>(ParameterFile::Parse(file.path(), file.text())));
  }
  const bool tables = target.tables && !shared.front()->root().children.empty();
  return ReadOne(target, shared, tables ? shared.front()->root().children.front().name : "");
}

std::vector<std::string> WrittenFor(const VehicleFile& skeleton, const NeutralVehicle& vehicle) {
  constexpr int kDigits = 9;
  NeutralVehicle written = vehicle;
  for (const auto& [name, value] : skeleton.vehicle.body) {
    if (name.starts_with("raw_")) written.body[name] = value;
  }
  return WithTexts(skeleton, [&](const Reading& reading) -> std::string {
    const std::string name = reading.field->name;
    if (name.starts_with("raw_")) return "";
    const double value = written.Get(name, reading.rotor);
    if (std::isalpha(static_cast<unsigned char>(reading.leaf->text[0])) != 0) {
      return value < 0.0 ? "ccw" : "cw";
    }
    return NumberText(reading.field->unit.ToFile((value - reading.offset) / reading.scale, written,
                                                 reading.rotor),
                      kDigits);
  });
}

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
