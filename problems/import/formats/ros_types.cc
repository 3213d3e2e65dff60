#include "problems/import/formats/ros_types.h"

#include <charconv>
#include <sstream>

namespace trueline {
namespace {

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

constexpr char kCommonDefinitions[] = R"(
MSG: std_msgs/Header
time stamp
string frame_id
MSG: std_msgs/MultiArrayDimension
string label
uint32 size
uint32 stride
MSG: std_msgs/MultiArrayLayout
MultiArrayDimension[] dim
uint32 data_offset
MSG: std_msgs/UInt16MultiArray
MultiArrayLayout layout
uint16[] data
MSG: std_msgs/Int32MultiArray
MultiArrayLayout layout
int32[] data
MSG: std_msgs/Float32MultiArray
MultiArrayLayout layout
float32[] data
MSG: std_msgs/Float64MultiArray
MultiArrayLayout layout
float64[] data
MSG: std_msgs/Float32
float32 data
MSG: std_msgs/Float64
float64 data
MSG: std_msgs/String
string data
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
MSG: geometry_msgs/Pose
Point position
Quaternion orientation
MSG: geometry_msgs/Twist
Vector3 linear
Vector3 angular
MSG: geometry_msgs/Accel
Vector3 linear
Vector3 angular
MSG: geometry_msgs/Transform
Vector3 translation
Quaternion rotation
MSG: geometry_msgs/PoseWithCovariance
Pose pose
float64[36] covariance
MSG: geometry_msgs/TwistWithCovariance
Twist twist
float64[36] covariance
MSG: geometry_msgs/PointStamped
Header header
Point point
MSG: geometry_msgs/Vector3Stamped
Header header
Vector3 vector
MSG: geometry_msgs/QuaternionStamped
Header header
Quaternion quaternion
MSG: geometry_msgs/PoseStamped
Header header
Pose pose
MSG: geometry_msgs/PoseWithCovarianceStamped
Header header
PoseWithCovariance pose
MSG: geometry_msgs/TwistStamped
Header header
Twist twist
MSG: geometry_msgs/TwistWithCovarianceStamped
Header header
TwistWithCovariance twist
MSG: geometry_msgs/AccelStamped
Header header
Accel accel
MSG: geometry_msgs/TransformStamped
Header header
string child_frame_id
Transform transform
MSG: tf2_msgs/TFMessage
geometry_msgs/TransformStamped[] transforms
MSG: nav_msgs/Odometry
Header header
string child_frame_id
geometry_msgs/PoseWithCovariance pose
geometry_msgs/TwistWithCovariance twist
MSG: sensor_msgs/Imu
Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
MSG: sensor_msgs/MagneticField
Header header
geometry_msgs/Vector3 magnetic_field
float64[9] magnetic_field_covariance
MSG: sensor_msgs/FluidPressure
Header header
float64 fluid_pressure
float64 variance
MSG: sensor_msgs/Range
Header header
uint8 radiation_type
float32 field_of_view
float32 min_range
float32 max_range
float32 range
MSG: sensor_msgs/NavSatStatus
int8 status
uint16 service
MSG: sensor_msgs/NavSatFix
Header header
NavSatStatus status
float64 latitude
float64 longitude
float64 altitude
float64[9] position_covariance
uint8 position_covariance_type
MSG: sensor_msgs/BatteryState
Header header
float32 voltage
float32 temperature
float32 current
float32 charge
float32 capacity
float32 design_capacity
float32 percentage
uint8 power_supply_status
uint8 power_supply_health
uint8 power_supply_technology
bool present
float32[] cell_voltage
float32[] cell_temperature
string location
string serial_number
MSG: sensor_msgs/JointState
Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
MSG: actuator_msgs/Actuators
Header header
float64[] position
float64[] velocity
float64[] normalized
)";

}  // namespace

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

const RosTypes& CommonRosTypes() {
  static const RosTypes kTypes = [] {
    RosTypes types;
    ParseRosDefinition("", kCommonDefinitions, &types);
    return types;
  }();
  return kTypes;
}

}  // namespace trueline
