#include <fmt/format.h>

#include <cmath>

#include "problems/common/error.h"
#include "problems/simulators/vehicle_file.h"

namespace trueline {
namespace {

constexpr double kRpm = 60.0 / (2.0 * M_PI);  // rpm in a rad/s
constexpr double kPerRpm2 = 1.0 / (kRpm * kRpm);
constexpr double kPerRps2 = 4.0 * M_PI * M_PI;  // N/(rev/s)^2 in a N/(rad/s)^2
constexpr double kAirDensity = 1.225;           // kg/m^3, of PyFlyt and AirSim

// Orders of rotors: front right, rear left, ... with their spins.
const std::vector<FixedRotor> kPx4 = {{1, 1, -1}, {-1, -1, -1}, {1, -1, 1}, {-1, 1, 1}};
const std::vector<FixedRotor> kCrazyflie = {{1, 1, -1}, {-1, 1, 1}, {-1, -1, -1}, {1, -1, 1}};
const std::vector<FixedRotor> kFlightmare = {{1, -1, 1}, {1, 1, -1}, {-1, 1, 1}, {-1, -1, -1}};
const std::vector<FixedRotor> kFlightmareDev = {{1, 1, -1}, {-1, -1, -1}, {-1, 1, 1}, {1, -1, 1}};

const NumberUnit kByMass = {1.0, {{"m", 1}}};

using FileFields = std::vector<FileField>;

FileFields operator+(FileFields a, const FileFields& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// A field of each axis: name_x, ...
FileFields Axes(const std::string& name, const std::string& x, const std::string& y,
                const std::string& z, const NumberUnit& unit = {}) {
  return {{name + "_x", x, unit}, {name + "_y", y, unit}, {name + "_z", z, unit}};
}

// Places in axes forward-left-up: y and z change sign. `at`: their path but for
// the number of the axis.
FileFields Flu(const std::vector<std::string>& names, const std::string& at) {
  return {{names[0], at + "0"}, {names[1], at + "1", {-1.0}}, {names[2], at + "2", {-1.0}}};
}
const std::vector<std::string> kFromOrigin = {"x", "y", "z"}, kFromCentre = {"x_M", "y_M", "z_M"};

// The motor model of Gazebo, RotorS and CrazyS. `at`: path of a number in a rotor's element, or of
// the property that all share.
FileFields GazeboMotors(const std::string& at, const std::vector<std::string>& names) {
  return {{"k_f", at + names[0]},        {"k_m", at + names[1], {1.0, {{"k_f", -1}}}},
          {"tau", at + names[2]},        {"tau_down", at + names[3]},
          {"full_speed", at + names[4]}, {"rotor_speed_drag", at + names[5], kByMass}};
}

FileFields SdfMotors() {
  const FileFields fields =
      GazeboMotors("./", {"motorConstant", "momentConstant", "timeConstantUp", "timeConstantDown",
                          "maxRotVelocity", "rotorDragCoefficient"});
  return FileFields{{"spin", "./turningDirection"}} +
         Flu(kFromOrigin, "//link[name={./linkName}]/pose/") + fields;
}

// Simulated rotors weigh something in these formats: this share of the vehicle, in an export.
constexpr double kSmall = 1e-4;
FileFields SmallRotors(const std::string& mass, const std::string& x, const std::string& y,
                       const std::string& z) {
  return {{"small_mass", mass, {kSmall, {{"m", 1}}}},
          {"small_inertia", x, {kSmall, {{"I_z", 1}}}},
          {"small_inertia", y, {kSmall, {{"I_z", 1}}}},
          {"small_inertia", z, {kSmall, {{"I_z", 1}}}}};
}

const std::string kProperty = "//xacro:property[name=";
std::string Property(const std::string& name) { return kProperty + name + "]/@value"; }

// PX4's parameters of an airframe, or the defaults in their definition.
std::string Px4(const std::string& name) {
  return name + "|parameters/0/definitions/" + name + "/default";
}

// The controller's copy; `again`: beside the xacro of the vehicle.
FileFields RotorsController(bool again) {
  FileFields fields =
      Axes("I", "inertia/xx", "inertia/yy", "inertia/zz") +
      FileFields{{"m", "mass"},
                 {"radius", "rotor_configuration/{i}/arm_length"},
                 {"angle", "rotor_configuration/{i}/angle", {-1.0}},
                 {"k_f", "rotor_configuration/{i}/rotor_force_constant"},
                 {"k_m", "rotor_configuration/{i}/rotor_moment_constant", {1.0, {{"k_f", -1}}}},
                 {"spin", "rotor_configuration/{i}/direction", {-1.0}}};
  for (FileField& field : fields) field.again = again;
  return fields;
}

std::vector<Target> MakeTargets() {
  const std::string rotor_link = "//link[name={./linkName}]/inertial/";
  const FileFields sdf =
      SdfMotors() + SmallRotors(rotor_link + "mass", rotor_link + "inertia/ixx",
                                rotor_link + "inertia/iyy", rotor_link + "inertia/izz");
  const std::string gazebo_lacks =
      "linear drag enters as rotor drag, exact in hover thrust; the rolling moment is along the "
      "velocity, so it is 0";
  const auto dynamics = [](const std::string& key) { return "quadrotor_dynamics/" + key; };
  const FileFields flightmare = {{"m", dynamics("mass")},
                                 {"k_f", dynamics("thrust_map/0")},
                                 {"k_f_1", dynamics("thrust_map/1")},
                                 {"k_f_0", dynamics("thrust_map/2")},
                                 {"k_m", dynamics("kappa"), {1.0, {{"k_f", -1}}}},
                                 {"idle_speed", dynamics("motor_omega_min")},
                                 {"full_speed", dynamics("motor_omega_max")},
                                 {"tau", dynamics("motor_tau")}};
  return {
      {.name = "rotorpy",
       .about = "RotorPy: the dictionary quad_params, as YAML",
       .skeletons = {"rotorpy.yaml"},
       .mark = "k_eta",
       .fields =
           Axes("I", "Ixx", "Iyy", "Izz") +
           FileFields{
               {"m", "mass"}, {"I_xy", "Ixy", {-1.0}}, {"I_xz", "Ixz", {-1.0}}, {"I_yz", "Iyz"}} +
           Flu(kFromCentre, "rotor_pos/r{r}/") +
           FileFields{{"spin", "rotor_directions/{i}"},
                      {"k_f", "k_eta"},
                      {"k_m", "k_m"},
                      {"full_speed", "rotor_speed_max"},
                      {"idle_speed", "rotor_speed_min"},
                      {"tau", "tau_m"},
                      {"rotor_speed_drag", "k_d", kByMass},
                      {"rotor_inflow", "k_z", kByMass},
                      {"translational_lift", "k_h", {1.0, {{"m", 1}, {"n", -1}}}}} +
           Axes("c", "c_Dx", "c_Dy", "c_Dz", kByMass),
       .caveat =
           "drag and inflow act at each hub, which moves as the body turns: inflow damps roll "
           "and pitch, too"},
      {.name = "px4_classic",
       .about = "PX4 with Gazebo classic: SDF with libgazebo_motor_model",
       .skeletons = {"px4_classic.sdf"},
       .mark = "//plugin[filename=libgazebo_motor_model.so]",
       .fields = sdf,
       .rotor_elements = "plugin",
       .rotor_number = "motorNumber",
       .links = LinkKind::kSdf,
       .gravity = 9.8,
       .caveat = gazebo_lacks + "; thrust falls by 1/25 for each m/s along the rotors' axis"},
      {.name = "gz",
       .about = "Gazebo (gz-sim): SDF with MulticopterMotorModel",
       .skeletons = {"gz.sdf"},
       .mark = "sdf",
       .fields = sdf,
       .rotor_elements = "plugin",
       .rotor_number = "motorNumber|actuator_number",
       .links = LinkKind::kSdf,
       .gravity = 9.8,
       .caveat = gazebo_lacks},
      {.name = "px4_sih",
       .about = "PX4 SIH: parameters SIH_... of an airframe",
       .skeletons = {"px4_sih.params"},
       .mark = Px4("SIH_MASS") + "|SIH_T_MAX",
       .fields = Axes("I", Px4("SIH_IXX"), Px4("SIH_IYY"), Px4("SIH_IZZ")) +
                 FileFields{{"m", Px4("SIH_MASS")},
                            {"I_xy", Px4("SIH_IXY")},
                            {"I_xz", Px4("SIH_IXZ")},
                            {"I_yz", Px4("SIH_IYZ")},
                            {"lever_y", Px4("SIH_L_ROLL")},
                            {"lever_x", Px4("SIH_L_PITCH")},
                            {"k_f", Px4("SIH_T_MAX"), {1.0, {{"full_speed", 2}}}},
                            {"k_m", Px4("SIH_Q_MAX"), {1.0, {{"full_speed", 2}}}},
                            {"tau", Px4("SIH_T_TAU")},
                            {"K", Px4("SIH_KDV"), {-1.0, {{"m", 1}}}},
                            {"damping", Px4("SIH_KDW")}},
       .order = kPx4,
       .gravity = kStandardGravity,
       .by_thrust = true,
       .caveat = "thrust is linear in the command and follows it with the lag; the same drag acts "
                 "along all axes"},
      {.name = "gym_pybullet_drones",
       .about = "gym-pybullet-drones: URDF with <properties>",
       .skeletons = {"gym_pybullet_drones.urdf"},
       .mark = "robot/properties/@kf",
       .fields = Flu(kFromCentre, "//link[name=prop{i}_link]/inertial/origin/@xyz/") +
                 FileFields{{"k_f", "robot/properties/@kf", {kPerRpm2}},
                            {"k_m", "robot/properties/@km", {kPerRpm2}},
                            {"full_speed",
                             "robot/properties/@thrust2weight",
                             {1.0, {{"n", 1}, {"k_f", 1}, {"m", -1}, {"g", -1}}, 2.0}},
                            {"rotor_speed_drag", "robot/properties/@drag_coeff_xy", kByMass},
                            {"rotor_inflow", "robot/properties/@drag_coeff_z", kByMass},
                            {"raw_prop_radius", "robot/properties/@prop_radius"},
                            {"ground_effect",
                             "robot/properties/@gnd_eff_coeff",
                             {16.0, {{"raw_prop_radius", -2}}, 2.0}},
                            {"arm", "robot/properties/@arm", {}, true}},
       .links = LinkKind::kUrdf,
       .order = kCrazyflie,
       .mirrored = {"robot/@name", "racer"},
       .gravity = 9.8,
       .caveat =
           "rotors follow their commands at once; drag coefficients act along the axes of the "
           "world, then turned: right in level flight"},
      {.name = "pyflyt",
       .about = "PyFlyt: YAML of motors and drag, and the URDF beside it",
       .skeletons = {"pyflyt.yaml", "pyflyt.urdf"},
       .mark = "motor_params/thrust_coef",
       .fields =
           Flu(kFromCentre, "//link[name=prop{r}_link]/inertial/origin/@xyz/") +
           FileFields{
               {"k_f", "motor_params/thrust_coef", {kPerRpm2}},
               {"k_m", "motor_params/torque_coef", {kPerRpm2}},
               {"full_speed", "motor_params/total_thrust", {1.0, {{"n", 1}, {"k_f", 1}}, 2.0}},
               {"tau", "motor_params/tau"},
               {"quadratic_damping", "drag_params/drag_coef_pqr"},
               {"raw_drag_coef", "drag_params/drag_coef_xyz"},
               {"c",
                "drag_params/drag_area_xyz",
                {2.0 / kAirDensity, {{"m", 1}, {"raw_drag_coef", -1}}}}},
       .links = LinkKind::kUrdf,
       .order = kPx4,
       .caveat = "drag is quadratic, by axis, and one number"},
      {.name = "mujoco",
       .about = "MuJoCo: MJCF with a motor for each rotor, whose control is its thrust in N",
       .skeletons = {"mujoco.xml"},
       .mark = "mujoco",
       .fields =
           Axes("I", "//inertial/@diaginertia/0", "//inertial/@diaginertia/1",
                "//inertial/@diaginertia/2") +
           Flu({"r_BM_x", "r_BM_y", "r_BM_z"}, "//inertial/@pos/") +
           Flu(kFromOrigin, "//site[name=rotor{i}]/@pos/") +
           FileFields{{"m", "//inertial/@mass"},
                      {"k_f", "//general[name=rotor{i}]/@ctrlrange/1", {1.0, {{"full_speed", 2}}}},
                      {"spin_k_m", "//general[name=rotor{i}]/@gear/5", {1.0, {{"k_f", -1}}}},
                      {"tau", "//general[name=rotor{i}]/@dynprm/0"}},
       .by_thrust = true,
       .caveat = "no air: density and viscosity are 0; the lag acts on thrust"},
      {.name = "crazyflow",
       .about = "crazyflow, drone-models: a table of first_principles parameters, TOML",
       .skeletons = {"crazyflow.toml"},
       .mark = "*/rpm2thrust",
       .fields = Axes("I", "J/0/0", "J/1/1", "J/2/2") +
                 FileFields{{"m", "mass"},
                            {"I_xy", "J/0/1", {-1.0}},
                            {"I_xz", "J/0/2", {-1.0}},
                            {"I_yz", "J/1/2"},
                            {"lever", "L"},
                            {"y_M", "mixing_matrix/0/{i}", {-1.0, {{"lever", -1}}}},
                            {"x_M", "mixing_matrix/1/{i}", {-1.0, {{"lever", -1}}}},
                            {"spin", "mixing_matrix/2/{i}"},
                            {"k_f", "rpm2thrust/2", {kPerRpm2}},
                            {"k_f_1", "rpm2thrust/1", {1.0 / kRpm}},
                            {"k_f_0", "rpm2thrust/0"},
                            {"k_m", "rpm2torque/2", {kPerRpm2}},
                            {"k_m_1", "rpm2torque/1", {1.0 / kRpm}},
                            {"k_m_0", "rpm2torque/0"},
                            {"J_r", "prop_inertia"},
                            {"rise", "rotor_dyn_coef/0", {}},
                            {"rise_2", "rotor_dyn_coef/1", {1.0 / kRpm}},
                            {"fall", "rotor_dyn_coef/2", {}},
                            {"fall_2", "rotor_dyn_coef/3", {1.0 / kRpm}},
                            {"full_speed", "thrust_max", {1.0, {{"k_f", 1}}, 2.0}},
                            {"idle_speed", "thrust_min", {1.0, {{"k_f", 1}}, 2.0}}} +
                 Axes("K", "drag_matrix/0/0", "drag_matrix/1/1", "drag_matrix/2/2", kByMass),
       .order = kCrazyflie,
       .tables = true},
      {.name = "flightmare",
       .about = "Flightmare (branch dev): YAML with quadrotor_dynamics",
       .skeletons = {"flightmare.yaml"},
       .mark = dynamics("tbm_fr"),
       .fields = Axes("I", dynamics("inertia/0"), dynamics("inertia/1"), dynamics("inertia/2")) +
                 flightmare + Flu(kFromCentre, dynamics("tbm_{fr,bl,br,fl}/")) +
                 FileFields{{"translational_lift", dynamics("body_drag_h"), kByMass}} +
                 Axes("K", dynamics("body_drag_1/0"), dynamics("body_drag_1/1"),
                      dynamics("body_drag_1/2"), {-1.0, {{"m", 1}}}),
       .order = kFlightmareDev,
       .also = "agilicious"},
      {.name = "airsim",
       .about = "AirSim: C++ that fills the parameters of a quadrotor, which are compiled in",
       .skeletons = {"airsim.hpp"},
       .mark = "//motor_assembly_weight",
       .fields = {{"m", "//mass"},
                  {"raw_motor_mass", "//motor_assembly_weight"},
                  {"small_motor_mass", "//motor_assembly_weight", {kSmall, {{"m", 1}}}},
                  {"x_M", "//rotor_{i}/0"},
                  {"y_M", "//rotor_{i}/1"},
                  {"z_M", "//rotor_{i}/2"},
                  {"box_x", "//body_box.x"},
                  {"box_y", "//body_box.y"},
                  {"box_z", "//body_box.z"},
                  {"full_speed", "//max_rpm", {kRpm}},
                  {"raw_prop_diameter", "//propeller_diameter"},
                  {"k_f", "//C_T", {4.0 * M_PI * M_PI / kAirDensity, {{"raw_prop_diameter", -4}}}},
                  {"k_m",
                   "//C_P",
                   {8.0 * M_PI * M_PI * M_PI / kAirDensity, {{"raw_prop_diameter", -5}}}},
                  {"tau", "//control_signal_filter_tc"}},
       .order = kPx4,
       .by_thrust = true,
       .caveat = "inertia is that of a box and point motors; thrust is linear in the command, and "
                 "the lag acts on it; drag is set to 0: its faces are those of that box"},
      {.name = "isaac_lab",
       .about = "Isaac Lab: a MultirotorCfg, in Python; mass and inertia are set beside it",
       .skeletons = {"isaac_lab.py"},
       .mark = "//torque_to_thrust_ratio",
       .fields = Axes("I", "//INERTIA/0", "//INERTIA/1", "//INERTIA/2") +
                 FileFields{{"m", "//MASS"},
                            {"k_f", "//thrust_const_range/0", {kPerRps2}},
                            {"k_f", "//thrust_const_range/1", {kPerRps2}},
                            {"full_speed", "//thrust_range/1", {1.0, {{"k_f", 1}}, 2.0}},
                            {"idle_speed", "//thrust_range/0", {1.0, {{"k_f", 1}}, 2.0}},
                            {"tau", "//tau_inc_range/0"},
                            {"tau", "//tau_inc_range/1"},
                            {"tau_down", "//tau_dec_range/0"},
                            {"tau_down", "//tau_dec_range/1"},
                            {"k_m", "//torque_to_thrust_ratio", {1.0, {{"k_f", -1}}}},
                            {"y_M", "//allocation_matrix/3/{i}", {-1.0}},
                            {"x_M", "//allocation_matrix/4/{i}", {-1.0}},
                            {"spin", "//rotor_directions/{i}", {-1.0}},
                            {"spin_k_m", "//allocation_matrix/5/{i}", {1.0, {{"k_f", -1}}}}},
       .order = kPx4,
       .caveat = "no air; commands are thrusts, and the lag acts on the rotor's speed"},
      {.name = "flightmare_master",
       .about = "Flightmare (branch master), which sets no inertia: read only",
       .mark = dynamics("arm_l"),
       .fields = FileFields{{"arm", dynamics("arm_l")}} + flightmare,
       .order = kFlightmare},
      {.name = "rotors",
       .about = "RotorS, CrazyS: xacro of the vehicle, and the controller's YAML beside it",
       .skeletons = {"rotors.xacro", "rotors.yaml"},
       .mark = "//xacro:property[name=motor_constant]",
       .fields =
           FileFields{{"raw_rotor_mass", Property("mass_rotor")},
                      {"small_mass", Property("mass_rotor"), {kSmall, {{"m", 1}}}},
                      {"body_mass", Property("mass")},
                      {"spin", "./@direction"}} +
           Flu(kFromOrigin, "./origin/@xyz/") +
           GazeboMotors("", {Property("motor_constant"), Property("moment_constant"),
                             Property("time_constant_up"), Property("time_constant_down"),
                             Property("max_rot_velocity"), Property("rotor_drag_coefficient")}) +
           Axes("I", "//inertia/@ixx", "//inertia/@iyy", "//inertia/@izz") + RotorsController(true),
       .rotor_elements = "xacro:vertical_rotor",
       .rotor_number = "@motor_number",
       .gravity = 9.8,
       .caveat = gazebo_lacks},
      {.name = "rotors_controller",
       .about = "the controller's YAML of RotorS and CrazyS: read only",
       .mark = "rotor_configuration",
       .fields = RotorsController(false),
       .gravity = 9.8},
      {.name = "mrs",
       .about = "MRS multirotor simulator: read only",
       .mark = "*/propulsion/force_constant",
       .fields = {{"m", "mass"},
                  {"raw_arm", "arm_length"},
                  {"raw_height", "body_height"},
                  {"y_M", "propulsion/allocation_matrix/{i}", {-1.0, {{"raw_arm", -1}}}},
                  {"k_f", "propulsion/force_constant", {kPerRpm2}},
                  {"raw_prop_radius", "propulsion/prop_radius"},
                  {"k_m",
                   "propulsion/moment_constant",
                   {1.0 / 3.0, {{"k_f", -1}, {"raw_prop_radius", -1}}}},
                  {"tau", "motor_time_constant"},
                  {"full_speed", "propulsion/rpm/max", {kRpm}},
                  {"idle_speed", "propulsion/rpm/min", {kRpm}},
                  {"c", "air_resistance_coeff", {1.0 / M_PI, {{"m", 1}, {"raw_arm", -2}}}}},
       .order = kPx4,
       .tables = true},
      {.name = "urdf",
       .about = "a URDF's links: read only",
       .mark = "robot/link",
       .fields = {},
       .links = LinkKind::kUrdf},
  };
}

}  // namespace

double NumberUnit::ToFile(double value, const NeutralVehicle& vehicle, int rotor) const {
  double number = power == 1.0 ? factor * value : factor * std::pow(value, power);
  for (const auto& [name, exponent] : with) number *= std::pow(vehicle.Get(name, rotor), exponent);
  return number;
}

double NumberUnit::FromFile(double number, const NeutralVehicle& vehicle, int rotor) const {
  for (const auto& [name, exponent] : with) number /= std::pow(vehicle.Get(name, rotor), exponent);
  return power == 1.0 ? number / factor : std::pow(number / factor, 1.0 / power);
}

bool FileField::OfRotor() const {
  return path.starts_with("./") || path.find('{') != std::string::npos;
}

bool Target::Has(const std::string& name_of_number) const {
  for (const FileField& field : fields) {
    const std::string& name_of_field = field.name;
    if (name_of_field == name_of_number && !field.again) return true;
    if (name_of_field == "rise" && name_of_number == "tau") return true;
    if (name_of_field == "K" && name_of_number.starts_with("K_")) return true;
    if (name_of_field == "c" && name_of_number.starts_with("c_")) return true;
  }
  return false;
}

const std::vector<Target>& Targets() {
  static const std::vector<Target> targets = MakeTargets();
  return targets;
}

std::string TargetList() {
  std::string list;
  for (const Target& target : Targets()) {
    if (target.skeletons.empty()) continue;
    list += fmt::format("  {:<21}{}\n", target.name, target.about);
    if (!target.also.empty()) list += fmt::format("  {:<21}as {}\n", target.also, target.name);
  }
  return list;
}

const Target& FindTarget(const std::string& name) {
  for (const Target& target : Targets()) {
    if (target.skeletons.empty()) continue;
    if (target.name == name || (!name.empty() && target.also == name)) return target;
  }
  throw InputError(fmt::format("--to={}: no such target; use one of\n{}", name, TargetList()));
}

}  // namespace trueline
