#include "problems/import/formats/ros_decoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <set>
#include <sstream>

#include "problems/import/formats/bytes.h"

namespace trueline {
namespace {

constexpr std::size_t kMaxListed = 64;    // numbers of one list that become fields
constexpr std::size_t kMaxElements = 8;   // likewise, messages
constexpr std::size_t kMaxLeaves = 4096;  // fields of one channel
constexpr int kMaxDepth = 24;
// Messages without bytes can nest in each other so often that a walk through them never ends.
constexpr std::size_t kMaxParts = 65536;  // of one type, numbers and messages, lists with each part
constexpr std::size_t kStepsOfByte = 64;  // of one message, beside those of its type

// Reads primitives in either encoding. In CDR each is aligned to its own size, counted from after
// the four bytes of encapsulation.
class RosWire {
 public:
  RosWire(std::string_view message, bool cdr) : bytes_(message), cdr_(cdr) {
    if (!cdr) return;
    if (message.size() < 4 || message[0] != 0) {
      ok_ = false;
      return;
    }
    const auto kind = static_cast<unsigned char>(message[1]);
    ok_ = kind <= 1 || kind == 6 || kind == 7;  // plain CDR, of XCDR 1 or 2
    swap_ = kind % 2 == 0;
    max_align_ = kind >= 6 ? 4 : 8;
    bytes_.remove_prefix(4);
  }

  Cell Number(Scalar type) {
    const std::size_t size = SizeOf(type);
    const std::string_view raw = Aligned(size, size);
    if (!ok_) return Cell();
    if (!swap_) return ReadScalar(type, raw.data());
    char swapped[8];
    std::reverse_copy(raw.begin(), raw.end(), swapped);
    return ReadScalar(type, swapped);
  }
  std::uint32_t Count() {
    const Cell count = Number(Scalar::kU32);
    return ok_ ? static_cast<std::uint32_t>(count.Number()) : 0;
  }
  // Nanoseconds. ROS 1 has unsigned seconds, ROS 2 signed ones.
  Cell Time() {
    const Cell seconds = Number(cdr_ ? Scalar::kI32 : Scalar::kU32);
    const Cell nanoseconds = Number(Scalar::kU32);
    if (!ok_) return Cell();
    return Cell(static_cast<std::int64_t>(seconds.Number()) * kNsPerSecond +
                static_cast<std::int64_t>(nanoseconds.Number()));
  }
  void SkipText(std::size_t width) { Aligned(0, std::uint64_t{Count()} * width); }
  void SkipNumbers(Scalar type, std::uint64_t count) {
    if (count > 0) Aligned(SizeOf(type), count * SizeOf(type));
  }
  void Fail() { ok_ = false; }
  // Counts parts that are about to be visited. False, and no more is read, where they are too many.
  bool Visit(std::size_t parts) {
    steps_ += parts;
    if (steps_ > kMaxParts + kStepsOfByte * bytes_.size()) Exhaust();
    return ok_;
  }
  void Exhaust() {
    ok_ = false;
    exhausted_ = true;
  }

  bool ok() const { return ok_; }
  bool exhausted() const { return exhausted_; }
  bool cdr() const { return cdr_; }
  std::size_t left() const { return bytes_.size() - at_; }

 private:
  std::string_view Aligned(std::size_t size, std::uint64_t count) {
    if (cdr_ && size > 1) {
      const std::size_t align = std::min(size, max_align_);
      const std::size_t gap = (align - at_ % align) % align;
      if (gap > left()) ok_ = false;
      if (ok_) at_ += gap;
    }
    if (!ok_ || count > left()) {
      ok_ = false;
      return {};
    }
    const std::string_view raw = bytes_.substr(at_, count);
    at_ += count;
    return raw;
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  std::size_t steps_ = 0;
  std::size_t max_align_ = 8;
  bool cdr_ = false, swap_ = false, ok_ = true, exhausted_ = false;
};

// What of a value becomes fields, fixed by the channel's first message: a number is one leaf, a
// message or list has a node for each of its parts.
struct RosNode {
  std::size_t leaves = 0;
  std::vector<RosNode> parts;
};

// A walk through a message: through a channel's first one to find its fields, where there are
// `names`, else for the numbers of the leaves.
struct RosVisit {
  RosWire wire;
  std::vector<std::string>* names = nullptr;
  std::vector<Cell>* cells = nullptr;
  std::size_t next = 0;  // leaf

  void Put(const Cell& cell) {
    if (cells != nullptr && next < cells->size()) (*cells)[next] = cell;
    ++next;
  }
  bool HasRoom() const { return names->size() < kMaxLeaves; }
};

class RosDecoder : public MessageDecoder {
 public:
  RosDecoder(const std::string& type, const std::string& definition, bool cdr)
      : type_(RosTypeName(type)), cdr_(cdr) {
    if (definition.empty()) {
      types_ = CommonRosTypes();
    } else if (!ParseRosDefinition(type, definition, &types_)) {
      types_.clear();
    }
  }

  bool Describe(std::string_view message, Channel* channel) override {
    if (too_many_) return false;
    std::vector<std::string> names;
    root_ = {};
    nodes_ = 0;
    RosVisit visit{RosWire(message, cdr_), &names};
    Message(type_, "", 0, &root_, &visit);
    too_many_ = visit.wire.exhausted();
    if (!visit.wire.ok() || names.empty()) return false;
    for (const std::string& name : names) {
      channel->fields.push_back({name, times_.contains(name) ? "ns" : ""});
    }
    for (const char* stamp : {"header.stamp", "stamp", "timestamp"}) {
      if (channel->stamp_field < 0 && times_.contains(stamp)) channel->SetStamp(stamp, 0);
    }
    return true;
  }

  bool Decode(std::string_view message, std::vector<Cell>* cells) const override {
    if (too_many_) return false;
    RosVisit visit{RosWire(message, cdr_), nullptr, cells};
    Message(type_, "", 0, &root_, &visit);
    too_many_ = visit.wire.exhausted();
    return visit.wire.ok();
  }

  bool MayGrow() const override { return may_grow_; }
  std::string Refusal() const override {
    if (!too_many_) return "";
    return fmt::format("its type {} has more than {} parts", type_, kMaxParts);
  }

 private:
  // A null node: nothing of the value is wanted.
  void Message(const std::string& type, const std::string& prefix, int depth, RosNode* node,
               RosVisit* visit) const {
    const auto found = types_.find(type);
    if (found == types_.end() || depth >= kMaxDepth) return visit->wire.Fail();
    const std::vector<RosField>& fields = found->second;
    const bool describes = node != nullptr && visit->names != nullptr;
    if (describes && (nodes_ += fields.size()) > kMaxParts) visit->wire.Exhaust();
    if (!visit->wire.Visit(fields.size() + 1)) return;
    const std::size_t before = describes ? visit->names->size() : 0;
    if (describes) node->parts.resize(fields.size());
    for (std::size_t i = 0; i < fields.size() && visit->wire.ok(); ++i) {
      RosNode* part = node != nullptr && i < node->parts.size() ? &node->parts[i] : nullptr;
      List(fields[i], describes ? prefix + fields[i].name : "", depth, part, visit);
    }
    if (fields.empty() && cdr_) visit->wire.SkipNumbers(Scalar::kU8, 1);
    if (describes) node->leaves = visit->names->size() - before;
  }

  // A field of any kind; one that is no list is the list's only element.
  void List(const RosField& field, const std::string& name, int depth, RosNode* node,
            RosVisit* visit) const {
    if (!field.is_list) return One(field, name, depth, node, visit);
    const std::uint64_t count = field.length ? *field.length : visit->wire.Count();
    const bool describes = node != nullptr && visit->names != nullptr;
    const std::size_t before = describes ? visit->names->size() : 0;
    if (describes) {
      const std::size_t most = field.kind == RosKind::kMessage ? kMaxElements : kMaxListed;
      node->parts.resize(visit->HasRoom() ? std::min<std::uint64_t>(count, most) : 0);
      nodes_ += node->parts.size();
      may_grow_ |= !field.length;
    }
    const std::size_t listed = node == nullptr ? 0 : node->parts.size();
    for (std::size_t i = 0; i < listed; ++i) {
      if (i < count && visit->wire.ok()) {
        One(field, describes ? fmt::format("{}[{}]", name, i) : "", depth, &node->parts[i], visit);
      } else {
        visit->next += node->parts[i].leaves;
      }
    }
    if (count > listed) Skip(field, count - listed, depth, visit);
    if (describes) node->leaves = visit->names->size() - before;
  }

  void One(const RosField& field, const std::string& name, int depth, RosNode* node,
           RosVisit* visit) const {
    const bool is_number = field.kind == RosKind::kNumber || field.kind == RosKind::kTime;
    bool is_wanted = node != nullptr && node->leaves > 0;
    if (node != nullptr && visit->names != nullptr && visit->HasRoom()) {
      is_wanted = is_number || field.kind == RosKind::kMessage;
      if (is_number) node->leaves = 1;
      if (is_number) visit->names->push_back(name);
      if (field.kind == RosKind::kTime) times_.insert(name);
    }
    if (!is_wanted) return Skip(field, 1, depth, visit);
    if (!is_number) return Message(field.message, name + ".", depth + 1, node, visit);
    visit->Put(field.kind == RosKind::kTime ? visit->wire.Time()
                                            : visit->wire.Number(field.scalar));
  }

  void Skip(const RosField& field, std::uint64_t count, int depth, RosVisit* visit) const {
    RosWire& wire = visit->wire;
    if (field.kind == RosKind::kNumber) return wire.SkipNumbers(field.scalar, count);
    for (std::uint64_t i = 0; i < count && wire.ok(); ++i) {
      if (field.kind == RosKind::kMessage) {
        const std::size_t before = wire.left();
        Message(field.message, "", depth + 1, nullptr, visit);
        if (wire.left() == before) return;  // a message without bytes, any number of times
      } else if (field.kind == RosKind::kTime) {
        wire.Time();
      } else {
        wire.SkipText(field.kind == RosKind::kWideText ? 2 : 1);
      }
    }
  }

  std::string type_;
  bool cdr_;
  RosTypes types_;
  mutable RosNode root_;
  // By walks that describe a channel, but for `too_many_`.
  mutable std::size_t nodes_ = 0;                     // below the root
  mutable bool may_grow_ = false;                     // the type has lists of any length
  mutable std::set<std::string, std::less<>> times_;  // names of fields that are times
  mutable bool too_many_ = false;                     // parts: no message is visited again
};

const std::map<std::string, Scalar, std::less<>> kRosScalars = {
    {"bool", Scalar::kU8},     {"byte", Scalar::kU8},    {"char", Scalar::kU8},
    {"int8", Scalar::kI8},     {"uint8", Scalar::kU8},   {"int16", Scalar::kI16},
    {"uint16", Scalar::kU16},  {"int32", Scalar::kI32},  {"uint32", Scalar::kU32},
    {"int64", Scalar::kI64},   {"uint64", Scalar::kU64}, {"float32", Scalar::kF32},
    {"float64", Scalar::kF64}, {"float", Scalar::kF32},  {"double", Scalar::kF64},
    {"octet", Scalar::kU8}};

// Takes "[]", "[n]" or "[<=n]" off the end of a type.
bool TakeList(std::string* type, RosField* field) {
  const std::size_t bracket = type->find('[');
  if (bracket == std::string::npos) return true;
  field->is_list = true;
  const std::string inside = type->substr(bracket + 1);
  type->resize(bracket);
  if (inside == "]" || inside.starts_with("<=")) return true;
  std::uint32_t length = 0;
  const char* end = inside.data() + inside.size();
  const auto [stop, error] = std::from_chars(inside.data(), end, length);
  if (error != std::errc() || stop + 1 != end || *stop != ']') return false;
  field->length = length;
  return true;
}

// `package` is that of the type that the field belongs to.
void SetKind(const std::string& type, const std::string& package, RosField* field) {
  const std::string plain = type.substr(0, type.find('<'));  // string<=10 is a string
  if (const auto scalar = kRosScalars.find(plain); scalar != kRosScalars.end()) {
    field->scalar = scalar->second;
    return;
  }
  const std::string name = RosTypeName(plain);
  if (plain == "string") {
    field->kind = RosKind::kText;
  } else if (plain == "wstring") {
    field->kind = RosKind::kWideText;
  } else if (plain == "time" || plain == "duration" || name == "builtin_interfaces/Time" ||
             name == "builtin_interfaces/Duration") {
    field->kind = RosKind::kTime;
  } else {
    field->kind = RosKind::kMessage;
    const bool is_header = name == "Header";
    field->message = is_header
                         ? "std_msgs/Header"
                         : (name.find('/') == std::string::npos ? package + "/" + name : name);
  }
}

enum class RosLine { kEmpty, kField, kBad };

// "type name", "type name default", "type NAME=constant", with a comment.
RosLine ParseRosLine(std::string line, const std::string& package, RosField* field) {
  line = line.substr(0, line.find('#'));
  std::istringstream words(line);
  std::string type, rest;
  if (!(words >> type)) return RosLine::kEmpty;
  if (!(words >> field->name)) return RosLine::kBad;
  std::getline(words, rest);
  const std::size_t equals = field->name.find('=');
  const std::size_t first = rest.find_first_not_of(" \t");
  if (equals != std::string::npos) return RosLine::kEmpty;
  if (first != std::string::npos && rest[first] == '=') return RosLine::kEmpty;
  if (!TakeList(&type, field)) return RosLine::kBad;
  SetKind(type, package, field);
  return RosLine::kField;
}

// Of std_msgs, geometry_msgs, nav_msgs, sensor_msgs, tf2_msgs and actuator_msgs, as their packages
// define them, with ';' at the ends of lines.
constexpr char kCommonDefinitions[] = R"(
MSG: std_msgs/Header; time stamp; string frame_id
MSG: std_msgs/MultiArrayDimension; string label; uint32 size; uint32 stride
MSG: std_msgs/MultiArrayLayout; MultiArrayDimension[] dim; uint32 data_offset
MSG: std_msgs/UInt16MultiArray; MultiArrayLayout layout; uint16[] data
MSG: std_msgs/Int32MultiArray; MultiArrayLayout layout; int32[] data
MSG: std_msgs/Float32MultiArray; MultiArrayLayout layout; float32[] data
MSG: std_msgs/Float64MultiArray; MultiArrayLayout layout; float64[] data
MSG: std_msgs/Float32; float32 data
MSG: std_msgs/Float64; float64 data
MSG: std_msgs/String; string data
MSG: geometry_msgs/Vector3; float64 x; float64 y; float64 z
MSG: geometry_msgs/Point; float64 x; float64 y; float64 z
MSG: geometry_msgs/Quaternion; float64 x; float64 y; float64 z; float64 w
MSG: geometry_msgs/Pose; Point position; Quaternion orientation
MSG: geometry_msgs/Twist; Vector3 linear; Vector3 angular
MSG: geometry_msgs/Accel; Vector3 linear; Vector3 angular
MSG: geometry_msgs/Transform; Vector3 translation; Quaternion rotation
MSG: geometry_msgs/PoseWithCovariance; Pose pose; float64[36] covariance
MSG: geometry_msgs/TwistWithCovariance; Twist twist; float64[36] covariance
MSG: geometry_msgs/PointStamped; Header header; Point point
MSG: geometry_msgs/Vector3Stamped; Header header; Vector3 vector
MSG: geometry_msgs/QuaternionStamped; Header header; Quaternion quaternion
MSG: geometry_msgs/PoseStamped; Header header; Pose pose
MSG: geometry_msgs/PoseWithCovarianceStamped; Header header; PoseWithCovariance pose
MSG: geometry_msgs/TwistStamped; Header header; Twist twist
MSG: geometry_msgs/TwistWithCovarianceStamped; Header header; TwistWithCovariance twist
MSG: geometry_msgs/AccelStamped; Header header; Accel accel
MSG: geometry_msgs/TransformStamped; Header header; string child_frame_id; Transform transform
MSG: tf2_msgs/TFMessage; geometry_msgs/TransformStamped[] transforms
MSG: nav_msgs/Odometry; Header header; string child_frame_id;
geometry_msgs/PoseWithCovariance pose; geometry_msgs/TwistWithCovariance twist
MSG: sensor_msgs/Imu; Header header; geometry_msgs/Quaternion orientation;
float64[9] orientation_covariance; geometry_msgs/Vector3 angular_velocity;
float64[9] angular_velocity_covariance; geometry_msgs/Vector3 linear_acceleration;
float64[9] linear_acceleration_covariance
MSG: sensor_msgs/MagneticField; Header header; geometry_msgs/Vector3 magnetic_field;
float64[9] magnetic_field_covariance
MSG: sensor_msgs/FluidPressure; Header header; float64 fluid_pressure; float64 variance
MSG: sensor_msgs/Range; Header header; uint8 radiation_type; float32 field_of_view;
float32 min_range; float32 max_range; float32 range
MSG: sensor_msgs/NavSatStatus; int8 status; uint16 service
MSG: sensor_msgs/NavSatFix; Header header; NavSatStatus status; float64 latitude;
float64 longitude; float64 altitude; float64[9] position_covariance; uint8 position_covariance_type
MSG: sensor_msgs/BatteryState; Header header; float32 voltage; float32 temperature;
float32 current; float32 charge; float32 capacity; float32 design_capacity; float32 percentage;
uint8 power_supply_status; uint8 power_supply_health; uint8 power_supply_technology; bool present;
float32[] cell_voltage; float32[] cell_temperature; string location; string serial_number
MSG: sensor_msgs/JointState; Header header; string[] name; float64[] position; float64[] velocity;
float64[] effort
MSG: actuator_msgs/Actuators; Header header; float64[] position; float64[] velocity;
float64[] normalized
)";

}  // namespace

std::unique_ptr<MessageDecoder> MakeRos1Decoder(const std::string& type,
                                                const std::string& definition) {
  return std::make_unique<RosDecoder>(type, definition, false);
}

std::unique_ptr<MessageDecoder> MakeCdrDecoder(const std::string& type,
                                               const std::string& definition) {
  return std::make_unique<RosDecoder>(type, definition, true);
}

std::string RosTypeName(std::string_view name) {
  const std::size_t middle = name.find("/msg/");
  if (middle == std::string_view::npos) return std::string(name);
  return std::string(name.substr(0, middle)) + std::string(name.substr(middle + 4));
}

bool ParseRosDefinition(const std::string& name, std::string_view definition, RosTypes* types) {
  std::string type = RosTypeName(name);
  if (!type.empty()) (*types)[type].clear();
  std::istringstream lines{std::string(definition)};
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.starts_with("===")) continue;
    if (line.starts_with("MSG: ")) {
      type = RosTypeName(line.substr(5, line.find_last_not_of(" \t") - 4));
      (*types)[type].clear();
      continue;
    }
    RosField field;
    const RosLine parsed = ParseRosLine(line, type.substr(0, type.find('/')), &field);
    if (parsed == RosLine::kBad) return false;
    if (parsed == RosLine::kField) (*types)[type].push_back(field);
  }
  return true;
}

std::string RosLayout(const std::string& name, const std::string& definition) {
  RosTypes types;
  if (!ParseRosDefinition(name, definition, &types)) return definition;
  std::string layout;
  for (const auto& [type, fields] : types) {
    layout += type + ":";
    for (const RosField& field : fields) {
      layout += fmt::format("{} {} {} {} {} {};", field.name, static_cast<int>(field.kind),
                            static_cast<int>(field.scalar), field.message, field.is_list,
                            field.length.value_or(0));
    }
  }
  return layout;
}

const RosTypes& CommonRosTypes() {
  static const RosTypes kTypes = [] {
    std::string definitions = kCommonDefinitions;
    std::replace(definitions.begin(), definitions.end(), ';', '\n');
    RosTypes types;
    ParseRosDefinition("", definitions, &types);
    return types;
  }();
  return kTypes;
}

}  // namespace trueline
