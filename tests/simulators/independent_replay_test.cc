#include "tests/simulators/independent_replay.h"

#include <gtest/gtest.h>
#include <toml++/toml.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <fstream>
#include <map>
#include <pugixml.hpp>
#include <regex>
#include <sstream>

namespace trueline::replay {
namespace {

using Eigen::Vector3d;

constexpr double kRpm = 30.0 / M_PI;  // rpm in a rad/s

Vector3d Three(const std::string& text) {
  std::istringstream in(text);
  Vector3d v;
  in >> v.x() >> v.y() >> v.z();
  return v;
}

// First-order lag of the speeds; zero: at once.
auto SpeedLag(double tau) {
  return [tau](const std::vector<double>& commands, double dt, std::vector<double>* w) {
    const double left = tau > 0.0 ? std::exp(-dt / tau) : 0.0;
    for (std::size_t i = 0; i < w->size(); ++i) {
      (*w)[i] = commands[i] + left * ((*w)[i] - commands[i]);
    }
  };
}

// The same of the share of thrust.
void LagOnThrust(double tau, double full_speed, Simulator* s) {
  s->settled = [full_speed](const std::vector<double>& commands) {
    std::vector<double> u;
    for (const double w : commands) u.push_back(w * w / (full_speed * full_speed));
    return u;
  };
  s->drive = [tau, settled = s->settled](const std::vector<double>& commands, double dt,
                                         std::vector<double>* u) {
    const std::vector<double> wanted = settled(commands);
    for (std::size_t i = 0; i < u->size(); ++i) {
      (*u)[i] = wanted[i] + std::exp(-dt / tau) * ((*u)[i] - wanted[i]);
    }
  };
}

Vector3d BodyVelocity(const State& s) { return s.q.conjugate() * s.v; }

// A force at a place.
void Push(const Vector3d& force, const Vector3d& place, Wrench* sum) {
  sum->force += force;
  sum->moment += place.cross(force);
}

State Plus(const State& s, const State& rate, double dt) {
  State next;
  next.p = s.p + dt * rate.p, next.v = s.v + dt * rate.v, next.w = s.w + dt * rate.w;
  next.q.coeffs() = s.q.coeffs() + dt * rate.q.coeffs();
  return next;
}

State RateOf(const Simulator& simulator, const State& s, const std::vector<double>& rotors) {
  const Wrench wrench = simulator.wrench(rotors, s);
  State rate;
  rate.p = s.v;
  rate.v = s.q.normalized() * wrench.force / simulator.mass - simulator.gravity * Vector3d::UnitZ();
  rate.w = simulator.inertia.inverse() * (wrench.moment - s.w.cross(simulator.inertia * s.w));
  rate.q = s.q * Eigen::Quaterniond(0.0, 0.5 * s.w.x(), 0.5 * s.w.y(), 0.5 * s.w.z());
  return rate;
}

struct Urdf {
  double mass;
  Vector3d centre;
  Eigen::Matrix3d inertia;
  std::map<std::string, Vector3d> places;  // of links
};

Urdf ReadUrdf(const pugi::xml_node& robot) {
  Urdf urdf;
  for (const pugi::xml_node& link : robot.children("link")) {
    const pugi::xml_node inertial = link.child("inertial");
    const Vector3d place = Three(inertial.child("origin").attribute("xyz").value());
    urdf.places[link.attribute("name").value()] = place;
    if (std::string(link.attribute("name").value()) != "base_link") continue;
    urdf.mass = inertial.child("mass").attribute("value").as_double();
    urdf.centre = place;
    const auto i = [&](const char* name) {
      return inertial.child("inertia").attribute(name).as_double();
    };
    urdf.inertia << i("ixx"), i("ixy"), i("ixz"), i("ixy"), i("iyy"), i("iyz"), i("ixz"), i("iyz"),
        i("izz");
  }
  return urdf;
}

}  // namespace

Flight FlyWith(const Simulator& simulator, State start, const Pilot& pilot, double seconds) {
  constexpr double kStep = 0.001;
  const std::vector<double> first = pilot(0.0, start);
  std::vector<double> rotors = simulator.settled ? simulator.settled(first) : first;
  Flight flight;
  State s = start;
  const auto record = [&] {
    flight.states.push_back(s);
    flight.actuators.push_back(rotors);
    flight.force.emplace_back(simulator.wrench(rotors, s).force / simulator.mass);
  };
  record();
  for (int k = 0; k < static_cast<int>(std::lround(seconds / kStep)); ++k) {
    simulator.drive(pilot((k + 0.5) * kStep, s), kStep, &rotors);
    const State a = RateOf(simulator, s, rotors);
    const State b = RateOf(simulator, Plus(s, a, 0.5 * kStep), rotors);
    const State c = RateOf(simulator, Plus(s, b, 0.5 * kStep), rotors);
    const State d = RateOf(simulator, Plus(s, c, kStep), rotors);
    State mean = Plus(a, b, 2.0);
    mean = Plus(Plus(mean, c, 2.0), d, 1.0);
    s = Plus(s, mean, kStep / 6.0);
    s.q.normalize();
    record();
  }
  return flight;
}

std::vector<State> Fly(const Simulator& simulator, State start,
                       const std::function<std::vector<double>(double t)>& commands,
                       double seconds) {
  return FlyWith(
             simulator, start, [&](double t, const State&) { return commands(t); }, seconds)
      .states;
}

Simulator LoadRotorPy(const std::filesystem::path& file) {
  const YAML::Node y = YAML::LoadFile(file.string());
  const auto n = [y](const char* key) { return y[key].as<double>(); };
  Simulator s;
  s.mass = n("mass");
  s.inertia << n("Ixx"), n("Ixy"), n("Ixz"), n("Ixy"), n("Iyy"), n("Iyz"), n("Ixz"), n("Iyz"),
      n("Izz");
  std::vector<double> turns;
  for (int i = 0; i < n("num_rotors"); ++i) {
    const YAML::Node place = y["rotor_pos"]["r" + std::to_string(i + 1)];
    s.rotors.emplace_back(place[0].as<double>(), place[1].as<double>(), place[2].as<double>());
    turns.push_back(y["rotor_directions"][i].as<double>());
  }
  s.drive = SpeedLag(n("tau_m"));
  const Vector3d body(n("c_Dx"), n("c_Dy"), n("c_Dz")), hub(n("k_d"), n("k_d"), n("k_z"));
  s.wrench = [=, rotors = s.rotors, k_eta = n("k_eta"), k_h = n("k_h"), k_m = n("k_m"),
              k_flap = n("k_flap")](const std::vector<double>& w, const State& state) {
    const Vector3d v = BodyVelocity(state);
    Wrench sum{-v.norm() * body.cwiseProduct(v), Vector3d::Zero()};
    for (std::size_t i = 0; i < rotors.size(); ++i) {
      const Vector3d at = v + state.w.cross(rotors[i]);
      const double thrust = k_eta * w[i] * w[i] + k_h * at.head<2>().squaredNorm();
      Push(thrust * Vector3d::UnitZ() - w[i] * hub.cwiseProduct(at), rotors[i], &sum);
      sum.moment.z() += turns[i] * k_m * w[i] * w[i];
      sum.moment -= k_flap * w[i] * Vector3d(at.y(), -at.x(), 0.0);
    }
    return sum;
  };
  return s;
}

namespace {

// Numbers of a motor of the Gazebo family.
struct Motor {
  Vector3d place;
  double turn, k_f, moment, drag;
};

void UseMotors(const std::vector<Motor>& motors, bool classic, double tau, Simulator* s) {
  s->drive = SpeedLag(tau);
  s->wrench = [motors, classic](const std::vector<double>& w, const State& state) {
    constexpr double kMaxRelativeAirspeed = 25.0;
    const Vector3d v = BodyVelocity(state);
    Wrench sum;
    for (std::size_t i = 0; i < motors.size(); ++i) {
      const Motor& m = motors[i];
      const Vector3d at = v + state.w.cross(m.place);
      double thrust = m.k_f * w[i] * w[i];
      if (classic) thrust *= std::clamp(1.0 - std::abs(at.z()) / kMaxRelativeAirspeed, 0.0, 1.0);
      Push(Vector3d(-w[i] * m.drag * at.x(), -w[i] * m.drag * at.y(), thrust), m.place, &sum);
      sum.moment.z() -= m.turn * m.moment * thrust;
    }
    return sum;
  };
}

}  // namespace

Simulator LoadGazebo(const std::filesystem::path& file, bool classic) {
  pugi::xml_document document;
  document.load_file(file.c_str());
  const pugi::xml_node model = document.child("sdf").child("model");
  Simulator s;
  s.gravity = 9.8;
  Vector3d moment = Vector3d::Zero();
  for (int pass = 0; pass < 2; ++pass) {
    for (const pugi::xml_node& link : model.children("link")) {
      const pugi::xml_node inertial = link.child("inertial"), i = inertial.child("inertia");
      const double mass = inertial.child("mass").text().as_double();
      const Vector3d at =
          Three(link.child("pose").child_value()) +
          Three(inertial.child("pose").child_value()[0] != 0 ? inertial.child("pose").child_value()
                                                             : "0 0 0");
      if (pass == 0) {
        s.mass += mass;
        moment += mass * at;
        continue;
      }
      const Vector3d r = at - moment / s.mass;
      const auto e = [&](const char* name) { return i.child(name).text().as_double(); };
      Eigen::Matrix3d own;
      own << e("ixx"), e("ixy"), e("ixz"), e("ixy"), e("iyy"), e("iyz"), e("ixz"), e("iyz"),
          e("izz");
      s.inertia += own + mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
    }
  }
  std::vector<Motor> motors;
  double tau = 0.0;
  for (const pugi::xml_node& plugin : model.children("plugin")) {
    const std::string link = plugin.child("linkName").child_value();
    const auto number = [&](const char* name) { return plugin.child(name).text().as_double(); };
    const pugi::xml_node node = model.find_child_by_attribute("link", "name", link.c_str());
    motors.push_back(
        {Three(node.child("pose").child_value()) - moment / s.mass,
         std::string(plugin.child("turningDirection").child_value()) == "ccw" ? 1.0 : -1.0,
         number("motorConstant"), number("momentConstant"), number("rotorDragCoefficient")});
    tau = number("timeConstantUp");
  }
  UseMotors(motors, classic, tau, &s);
  return s;
}

Simulator LoadRotorS(const std::filesystem::path& file) {
  pugi::xml_document document;
  document.load_file(file.c_str());
  const pugi::xml_node robot = document.child("robot");
  const auto property = [&](const char* name) {
    return robot.find_child_by_attribute("xacro:property", "name", name);
  };
  const auto number = [&](const char* name) {
    return property(name).attribute("value").as_double();
  };
  Simulator s;
  s.gravity = 9.8;
  s.mass = number("mass");
  const pugi::xml_node i = property("body_inertia").child("inertia");
  s.inertia.diagonal() << i.attribute("ixx").as_double(), i.attribute("iyy").as_double(),
      i.attribute("izz").as_double();
  std::vector<Motor> motors;
  for (const pugi::xml_node& rotor : robot.children("xacro:vertical_rotor")) {
    const Vector3d at = Three(rotor.child("origin").attribute("xyz").value());
    s.mass += number("mass_rotor");
    s.inertia += number("mass_rotor") *
                 (at.squaredNorm() * Eigen::Matrix3d::Identity() - at * at.transpose());
    motors.push_back({at, std::string(rotor.attribute("direction").value()) == "ccw" ? 1.0 : -1.0,
                      number("motor_constant"), number("moment_constant"),
                      number("rotor_drag_coefficient")});
  }
  UseMotors(motors, false, number("time_constant_up"), &s);
  return s;
}

Simulator LoadSih(const std::filesystem::path& file, double full_speed) {
  std::map<std::string, double> p;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string param, set, name;
    double value = 0.0;
    if (words >> param >> set >> name >> value && param == "param") p[name] = value;
  }
  Simulator s;
  s.gravity = 9.80665;
  s.mass = p["SIH_MASS"];
  // Forward-right-down there: I_xy and I_xz change sign.
  s.inertia << p["SIH_IXX"], -p["SIH_IXY"], -p["SIH_IXZ"], -p["SIH_IXY"], p["SIH_IYY"],
      p["SIH_IYZ"], -p["SIH_IXZ"], p["SIH_IYZ"], p["SIH_IZZ"];
  LagOnThrust(p["SIH_T_TAU"], full_speed, &s);
  s.wrench = [p](const std::vector<double>& u, const State& state) {
    const auto of = [&](const char* name) { return p.at(name); };
    const double roll = of("SIH_L_ROLL") * of("SIH_T_MAX") * (-u[0] + u[1] + u[2] - u[3]);
    const double pitch = of("SIH_L_PITCH") * of("SIH_T_MAX") * (u[0] - u[1] + u[2] - u[3]);
    const double yaw = of("SIH_Q_MAX") * (u[0] + u[1] - u[2] - u[3]);
    Wrench sum;
    sum.force = Vector3d(0.0, 0.0, of("SIH_T_MAX") * (u[0] + u[1] + u[2] + u[3])) -
                of("SIH_KDV") * BodyVelocity(state);
    sum.moment = Vector3d(roll, -pitch, -yaw) - of("SIH_KDW") * state.w;
    return sum;
  };
  return s;
}

Simulator LoadGymPybullet(const std::filesystem::path& file) {
  pugi::xml_document document;
  document.load_file(file.c_str());
  const pugi::xml_node robot = document.child("robot"), p = robot.child("properties");
  const Urdf urdf = ReadUrdf(robot);
  Simulator s;
  s.mass = urdf.mass, s.inertia = urdf.inertia, s.gravity = 9.8;
  for (int i = 0; i < 4; ++i) {
    s.rotors.push_back(urdf.places.at("prop" + std::to_string(i) + "_link") - urdf.centre);
  }
  s.drive = SpeedLag(0.0);
  const auto number = [&](const char* name) { return p.attribute(name).as_double(); };
  s.wrench = [rotors = s.rotors, kf = number("kf"), km = number("km"),
              drag = Vector3d(number("drag_coeff_xy"), number("drag_coeff_xy"),
                              number("drag_coeff_z"))](const std::vector<double>& w,
                                                       const State& state) {
    Wrench sum;
    double rpms = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      const double rpm = w[i] * kRpm;
      rpms += rpm;
      Push(Vector3d(0.0, 0.0, kf * rpm * rpm), rotors[i], &sum);
      sum.moment.z() += (i % 2 == 0 ? -1.0 : 1.0) * km * rpm * rpm;
    }
    sum.force -= (2.0 * M_PI / 60.0) * rpms * (state.q.conjugate() * drag.cwiseProduct(state.v));
    return sum;
  };
  return s;
}

Simulator LoadPyFlyt(const std::filesystem::path& yaml, const std::filesystem::path& file) {
  const YAML::Node y = YAML::LoadFile(yaml.string());
  pugi::xml_document document;
  document.load_file(file.c_str());
  const Urdf urdf = ReadUrdf(document.child("robot"));
  Simulator s;
  s.mass = urdf.mass, s.inertia = urdf.inertia;
  for (int i = 1; i <= 4; ++i) {
    s.rotors.push_back(urdf.places.at("prop" + std::to_string(i) + "_link") - urdf.centre);
  }
  const YAML::Node motor = y["motor_params"], air = y["drag_params"];
  s.drive = SpeedLag(motor["tau"].as<double>());
  s.wrench = [rotors = s.rotors, centre = urdf.centre, t = motor["thrust_coef"].as<double>(),
              q = motor["torque_coef"].as<double>(),
              drag = 0.5 * 1.225 * air["drag_coef_xyz"].as<double>() *
                     air["drag_area_xyz"].as<double>()](const std::vector<double>& w,
                                                        const State& state) {
    const double turns[] = {-1.0, -1.0, 1.0, 1.0};
    Wrench sum;
    for (std::size_t i = 0; i < 4; ++i) {
      const double rpm = w[i] * kRpm;
      Push(Vector3d(0.0, 0.0, t * rpm * rpm), rotors[i], &sum);
      sum.moment.z() += turns[i] * q * rpm * rpm;
    }
    const Vector3d v = BodyVelocity(state);
    sum.force -= drag * v.cwiseProduct(v.cwiseAbs());
    return sum;
  };
  return s;
}

Simulator LoadMujoco(const std::filesystem::path& file, double full_speed) {
  pugi::xml_document document;
  document.load_file(file.c_str());
  const pugi::xml_node mujoco = document.child("mujoco");
  const pugi::xml_node body = mujoco.child("worldbody").child("body");
  const pugi::xml_node inertial = body.child("inertial");
  Simulator s;
  s.mass = inertial.attribute("mass").as_double();
  s.inertia = Three(inertial.attribute("diaginertia").value()).asDiagonal();
  const Vector3d centre = Three(inertial.attribute("pos").value());
  std::vector<double> most, moment;
  double tau = 0.0;
  for (const pugi::xml_node& motor : mujoco.child("actuator").children("general")) {
    const pugi::xml_node site =
        body.find_child_by_attribute("site", "name", motor.attribute("site").value());
    s.rotors.push_back(Three(site.attribute("pos").value()) - centre);
    std::istringstream range(motor.attribute("ctrlrange").value()),
        gear(motor.attribute("gear").value());
    double low = 0.0, high = 0.0, g[6] = {};
    range >> low >> high;
    for (double& x : g) gear >> x;
    most.push_back(high), moment.push_back(g[5]);
    tau = motor.attribute("dynprm").as_double();
  }
  LagOnThrust(tau, full_speed, &s);
  s.wrench = [rotors = s.rotors, most, moment](const std::vector<double>& u, const State&) {
    Wrench sum;
    for (std::size_t i = 0; i < rotors.size(); ++i) {
      Push(Vector3d(0.0, 0.0, most[i] * u[i]), rotors[i], &sum);
      sum.moment.z() += moment[i] * most[i] * u[i];
    }
    return sum;
  };
  return s;
}

namespace {

// Numbers after `name` and an equals sign, up to the end of the statement or bracket.
std::vector<double> NumbersAfter(const std::string& code, const std::string& name) {
  std::smatch found;
  const std::regex statement(name + R"(\s*=\s*(?:Vector3r)?[(\[]*([-+0-9.e,\s]+))");
  std::vector<double> numbers;
  if (!std::regex_search(code, found, statement)) return numbers;
  std::istringstream in(std::regex_replace(found[1].str(), std::regex(","), " "));
  for (double x = 0.0; in >> x;) numbers.push_back(x);
  return numbers;
}

std::string TextOfFile(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

}  // namespace

Simulator LoadAirSim(const std::filesystem::path& file, double full_speed) {
  constexpr double kRho = 1.225;
  const std::string code = TextOfFile(file);
  const auto n = [&](const char* name) { return NumbersAfter(code, name).at(0); };
  Simulator s;
  s.mass = n("params.mass");
  const double motor = n("motor_assembly_weight"), body = s.mass - 4.0 * motor;
  const Vector3d box(n("x\\(\\)"), n("y\\(\\)"), n("z\\(\\)"));
  s.inertia.diagonal() << body / 12.0 * (box.y() * box.y() + box.z() * box.z()),
      body / 12.0 * (box.x() * box.x() + box.z() * box.z()),
      body / 12.0 * (box.x() * box.x() + box.y() * box.y());
  for (int i = 0; i < 4; ++i) {
    const std::vector<double> p = NumbersAfter(code, "rotor_" + std::to_string(i));
    const Vector3d at(p[0], -p[1], -p[2]);  // forward-right-down there
    s.rotors.push_back(at);
    s.inertia += motor * (at.squaredNorm() * Eigen::Matrix3d::Identity() - at * at.transpose());
  }
  const double d = n("propeller_diameter"), revolutions = n("max_rpm") / 60.0;
  const double thrust = n("C_T") * kRho * revolutions * revolutions * std::pow(d, 4);
  const double torque = n("C_P") * kRho * revolutions * revolutions * std::pow(d, 5) / (2.0 * M_PI);
  LagOnThrust(n("control_signal_filter_tc"), full_speed, &s);
  s.wrench = [rotors = s.rotors, thrust, torque](const std::vector<double>& u, const State&) {
    const double turns[] = {-1.0, -1.0, 1.0, 1.0};
    Wrench sum;
    for (std::size_t i = 0; i < 4; ++i) {
      Push(Vector3d(0.0, 0.0, thrust * u[i]), rotors[i], &sum);
      sum.moment.z() += turns[i] * torque * u[i];
    }
    return sum;
  };
  return s;
}

Simulator LoadIsaacLab(const std::filesystem::path& file, double full_speed) {
  const std::string code = TextOfFile(file);
  Simulator s;
  s.mass = NumbersAfter(code, "MASS").at(0);
  const std::vector<double> inertia = NumbersAfter(code, "INERTIA");
  s.inertia.diagonal() << inertia.at(0), inertia.at(1), inertia.at(2);
  std::vector<std::vector<double>> rows;
  const std::regex row(R"(\n\s+\[([-0-9.e, +]+)\],)");
  for (std::sregex_iterator at(code.begin(), code.end(), row), end; at != end; ++at) {
    rows.emplace_back();
    std::istringstream in(std::regex_replace((*at)[1].str(), std::regex(","), " "));
    for (double x = 0.0; in >> x;) rows.back().push_back(x);
  }
  const double k = NumbersAfter(code, "thrust_const_range").at(0);  // N/(rev/s)^2
  const double per_speed = k / (4.0 * M_PI * M_PI);
  EXPECT_NEAR(NumbersAfter(code, "thrust_range").at(1), per_speed * full_speed * full_speed,
              1e-4 * per_speed * full_speed * full_speed);
  s.drive = SpeedLag(NumbersAfter(code, "tau_inc_range").at(0));
  s.wrench = [rows, per_speed](const std::vector<double>& w, const State&) {
    Wrench sum;
    for (std::size_t i = 0; i < w.size(); ++i) {
      const double thrust = per_speed * w[i] * w[i];
      sum.force += thrust * Vector3d(rows[0][i], rows[1][i], rows[2][i]);
      sum.moment += thrust * Vector3d(rows[3][i], rows[4][i], rows[5][i]);
    }
    return sum;
  };
  return s;
}

Simulator LoadCrazyflow(const std::filesystem::path& file) {
  const toml::table all = toml::parse_file(file.string());
  const toml::table& t = *all.begin()->second.as_table();
  const auto row = [&](const char* key, int i, int j) {
    return t[key].as_array()->get(i)->as_array()->get(j)->value<double>().value();
  };
  const auto at = [&](const char* key, int i) {
    return t[key].as_array()->get(i)->value<double>().value();
  };
  Simulator s;
  s.mass = t["mass"].value<double>().value();
  Eigen::Matrix3d drag;
  Eigen::Matrix<double, 3, 4> mixing;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j) mixing(i, j) = row("mixing_matrix", i, j);
    for (int j = 0; j < 3; ++j)
      s.inertia(i, j) = row("J", i, j), drag(i, j) = row("drag_matrix", i, j);
  }
  s.drive = SpeedLag(1.0 / at("rotor_dyn_coef", 0));
  s.wrench = [=, lever = t["L"].value<double>().value(), kf = at("rpm2thrust", 2),
              km = at("rpm2torque", 2)](const std::vector<double>& w, const State& state) {
    Eigen::Vector4d rpm2;
    for (int i = 0; i < 4; ++i) rpm2[i] = std::pow(w[static_cast<std::size_t>(i)] * kRpm, 2);
    Wrench sum;
    sum.force = Vector3d(0.0, 0.0, kf * rpm2.sum()) + drag * BodyVelocity(state);
    sum.moment = Vector3d(lever * kf * mixing.row(0) * rpm2, lever * kf * mixing.row(1) * rpm2,
                          km * mixing.row(2) * rpm2);
    return sum;
  };
  return s;
}

Simulator LoadFlightmare(const std::filesystem::path& file) {
  const YAML::Node y = YAML::LoadFile(file.string())["quadrotor_dynamics"];
  const auto three = [&](const char* key) {
    return Vector3d(y[key][0].as<double>(), y[key][1].as<double>(), y[key][2].as<double>());
  };
  Simulator s;
  s.mass = y["mass"].as<double>();
  s.inertia = three("inertia").asDiagonal();
  for (const char* arm : {"tbm_fr", "tbm_bl", "tbm_br", "tbm_fl"}) s.rotors.push_back(three(arm));
  s.drive = SpeedLag(y["motor_tau"].as<double>());
  s.wrench = [rotors = s.rotors, map = three("thrust_map"), kappa = y["kappa"].as<double>(),
              linear = three("body_drag_1"), cubic = three("body_drag_3"),
              lift = y["body_drag_h"].as<double>()](const std::vector<double>& w,
                                                    const State& state) {
    const double turns[] = {-1.0, -1.0, 1.0, 1.0};
    Wrench sum;
    for (std::size_t i = 0; i < 4; ++i) {
      const double thrust = map[0] * w[i] * w[i] + map[1] * w[i] + map[2];
      Push(Vector3d(0.0, 0.0, thrust), rotors[i], &sum);
      sum.moment.z() += turns[i] * kappa * thrust;
    }
    const Vector3d v = BodyVelocity(state);
    sum.force -= linear.cwiseProduct(v) + cubic.cwiseProduct(v.cwiseProduct(v.cwiseProduct(v)));
    sum.force.z() += lift * v.head<2>().squaredNorm();
    return sum;
  };
  return s;
}

}  // namespace trueline::replay
