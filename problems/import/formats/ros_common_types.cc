#include "problems/import/formats/ros_types.h"

namespace trueline {
namespace {

// Of std_msgs, geometry_msgs, nav_msgs, sensor_msgs, tf2_msgs and actuator_msgs, as their packages
// define them.
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

const RosTypes& CommonRosTypes() {
  static const RosTypes kTypes = [] {
    RosTypes types;
    ParseRosDefinition("", kCommonDefinitions, &types);
    return types;
  }();
  return kTypes;
}

}  // namespace trueline
