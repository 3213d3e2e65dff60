#include "problems/simulators/flight_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/calibration/without_poses.h"
#include "problems/common/error.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kHoldOut = 0.3;        // share of the flight
constexpr double kFastestPoses = 50.0;  // Hz
constexpr double kClear = 3.0;          // sigmas from zero
constexpr double kShown = 0.5;          // of the prior's sigma, that a flight leaves at most

// Wide priors: shares of the value, or of the mean distance of the rotors, or in the unit.
constexpr double kInertiaSigma = 0.6, kThrustSigma = 0.5, kMomentSigma = 0.8;
constexpr double kKnownSigma = 0.005;                 // of I_z: fits free all moments or none
constexpr double kPlaceSigma = 0.2;                   // of the arm
constexpr double kPoseArmSigma = 0.05;                // m
constexpr double kDragSigma = 1.0;                    // 1/s
constexpr double kDampingSigma = 10.0;                // 1/s
constexpr double kSpeedMomentSigma = 10.0;            // rad/m/s
constexpr double kPoseDelaySigma = 0.02;              // s
constexpr double kLagSigma = 0.05, kLagStart = 0.03;  // s
constexpr double kVoltageSigma = 0.5;                 // 1
// Of the rotors' yaw: drag at each hub, which simulators have and the fit has not.
constexpr double kYawByHubs = 0.03;

constexpr double kFactorOff = 1.5;  // of a first fit, beyond which a fit starts from it

// I_z over I_x + I_y of quadrotors.
constexpr double kTallest = 0.5;

// An I_z that no body has beside I_x and I_y would hold them away from the flight. Only its ratio
// to k_m counts.
void HoldUsualYaw(NeutralVehicle* v) {
  const double usual = kUsualYawInertia * (v->Get("I_x") + v->Get("I_y"));
  for (Numbers& rotor : v->rotors) rotor["k_m"] *= usual / v->Get("I_z");
  v->body["I_z"] = usual;
}

bool FarOff(double ratio) { return ratio > kFactorOff || ratio < 1.0 / kFactorOff; }

// Where the fit starts: the file, or near the flight where that is far off.
NeutralVehicle StartNear(const FlightLog& log, NeutralVehicle v) {
  const FirstFit first = FitFirst(log, v);
  if (FarOff(first.thrust) && first.thrust > 0.0) {
    for (Numbers& rotor : v.rotors) rotor["k_f"] *= first.thrust, rotor["k_m"] *= first.thrust;
  }
  const FirstFit scaled = FitFirst(log, v);
  constexpr const char* kAxes[] = {"I_x", "I_y", "I_z"};
  for (int k = 0; k < 3; ++k) {
    if (scaled.correlation[k] < kGoesTogether || !FarOff(scaled.turn[k])) continue;
    if (k < 2) v.body[kAxes[k]] /= scaled.turn[k];
    for (Numbers& rotor : v.rotors) rotor["k_m"] *= k == 2 ? scaled.turn[k] : 1.0;
  }
  const double others = v.Get("I_x") + v.Get("I_y"), yaw = v.Get("I_z");
  if (!(yaw > kTallest * others && yaw < others)) HoldUsualYaw(&v);
  return v;
}

double Rate(const std::vector<PoseSample>& poses) {
  return static_cast<double>(poses.size() - 1) / SecondsBetween(poses.front().t, poses.back().t);
}

// Commands of motors without measured speeds: the file's speeds at no and full command.
void DriveByCommands(const FlightLog& log, const NeutralVehicle& v, const FlightValue& shown_lag,
                     RotorCalibrationOptions* o) {
  const double full = v.Get("full_speed") > 0.0 ? v.Get("full_speed") : 2.0 * v.Get("w_h");
  MotorCurve& curve = o->data.motors.emplace();
  curve.full_speed = full;
  const bool battery = !log.battery.empty();
  if (battery) {
    double sum = 0.0;
    for (const ScalarSample& sample : log.battery) sum += sample.value;
    curve.nominal_voltage = sum / static_cast<double>(log.battery.size());
  }
  o->data.rotors = RotorSource::kMotors;
  const double start = shown_lag.shown ? shown_lag.value : std::max(kLagStart, v.Get("tau"));
  o->data.motors_at = MotorValues(start, v.Get("idle_speed") / full, battery ? 1.0 : 0.0);
  const int lag = FindRotorConstant("motor_lag");
  o->prior.mean.segment<kMotorUnknowns>(lag) = o->data.motors_at;
  o->prior.sigma[lag] = shown_lag.shown ? 0.0 : kLagSigma;
  o->prior.sigma[FindRotorConstant("motor_voltage")] = battery ? kVoltageSigma : 0.0;
}

void SetPrior(const std::string& name, double mean, double sigma, RotorPrior* prior) {
  prior->mean[FindRotorConstant(name)] = mean;
  prior->sigma[FindRotorConstant(name)] = sigma;
}

RotorCalibrationOptions OptionsFor(const FlightLog& log, const NeutralVehicle& v,
                                   const FlightValue& lag) {
  RotorCalibrationOptions o(RotorVehicleOf(v));
  o.data.source = log.pose.empty() ? PoseSource::kMocap : PoseSource::kPose;
  const std::vector<PoseSample>& poses = log.pose.empty() ? log.mocap : log.pose;
  if (poses.size() < 2) {
    throw ErrorAt(log.directory, 0,
                  "has no poses; an audit needs mocap.csv or pose.csv beside IMU and rotor speeds");
  }
  o.data.pose_rate = std::min(kFastestPoses, Rate(poses));
  o.hold_out = kHoldOut;
  o.noise.position = 0.005, o.noise.attitude = 0.01;
  o.noise.accel = 0.5, o.noise.gyro = 0.05;
  RotorPrior* prior = &o.prior;
  const auto free = [&](std::initializer_list<const char*> names, double mean, double sigma) {
    for (const char* name : names) SetPrior(name, mean, sigma, prior);
  };
  for (const char* name : {"r_BM_x", "r_BM_y", "r_BM_z", "r_BI_x", "r_BI_y"}) {
    prior->sigma[FindRotorConstant(name)] = kPlaceSigma * v.Get("arm");
  }
  for (const char* name : {"m", "r_BI_z"}) prior->sigma[FindRotorConstant(name)] = 0.0;
  free({"I_x"}, v.Get("I_x"), kInertiaSigma * v.Get("I_x"));
  free({"I_y"}, v.Get("I_y"), kInertiaSigma * v.Get("I_y"));
  free({"I_z"}, v.Get("I_z"), kKnownSigma * v.Get("I_z"));
  free({"r_BP_x", "r_BP_y", "r_BP_z"}, 0.0, kPoseArmSigma);
  free({"k_f"}, 1.0, kThrustSigma), free({"k_m"}, 1.0, kMomentSigma);
  free({"K_x", "K_y", "K_z"}, 0.0, kDragSigma);
  free({"L_p", "M_q", "N_r"}, 0.0, kDampingSigma), free({"L_v", "M_u"}, 0.0, kSpeedMomentSigma);
  free({"pose_delay"}, 0.0, kPoseDelaySigma);
  if (log.rotors.empty()) DriveByCommands(log, v, lag, &o);
  return o;
}

// Commands answer what the vehicle does, which biases a fit of its path: the lag is that of
// one-step predictions. Not shown where the flight is too short, slow or rough for them.
FlightValue LagByCommands(const FlightLog& log, const NeutralVehicle& v) {
  try {
    const RotorCalibrationOptions options(RotorVehicleOf(v));
    for (const ParameterEstimate& p : CalibrateWithoutPoses(log, options).parameters) {
      if (p.name == "motor_lag") return {p.value, p.sigma, true};
    }
  } catch (const InputError&) {
  }
  return {};
}

// How much larger the errors on held-out flight are than noise explains, at least 1: intervals are
// widened by it, because what the model lacks is in the constants, too.
double Misfit(const RotorCalibration& c) {
  constexpr double kByNoise = 0.95, kWidest = 5.0;
  constexpr int kEnough = 20;  // predictions
  const auto radius = [](double share) { return std::sqrt(ChiSquareCritical(1.0 - share, 3.0)); };
  for (const HorizonScore& score : c.predictions) {
    if (score.count < kEnough) continue;
    const double inside = std::clamp(score.inside_noise, 0.02, kByNoise);
    return std::min(kWidest, radius(kByNoise) / radius(inside));
  }
  return 1.0;
}

// By axis, a share of the inertia. The angular acceleration and the rotors' moments both have
// errors (delays, noise, moments of the air): the inertia lies between those by the slopes of the
// one over the other and of the other over the one (Frisch 1934), as likely here as there. By
// commands, whose speeds are the fit's, 0.
Eigen::Array3d SigmaOfSlopes(const FlightLog& log, const NeutralVehicle& v) {
  if (log.rotors.empty()) return Eigen::Array3d::Zero();
  return (1.0 - FitFirst(log, v).correlation.array().square()) / std::sqrt(12.0);
}

FlightValue ValueOf(const RotorCalibration& c, const RotorPrior& prior, const std::string& name,
                    double scale) {
  const int i = FindRotorConstant(name);
  const double sigma = Misfit(c) * std::sqrt(c.batch.cov(i, i));
  return {scale * c.batch.mean[i], scale * sigma, sigma < kShown * prior.sigma[i]};
}

}  // namespace

std::vector<int> LogOrder(const NeutralVehicle& vehicle, const FlightLog& log) {
  if (!log.vehicle || log.vehicle->rotors.size() != vehicle.rotors.size()) {
    return OrderByFlight(log, vehicle).rotors;
  }
  std::vector<int> order;
  for (const Rotor& rotor : log.vehicle->rotors) {
    int best = -1;
    double most = 0.0;
    for (int j = 0; j < static_cast<int>(vehicle.rotors.size()); ++j) {
      const double along = (rotor.position.x() * vehicle.Get("x_M", j) +
                            rotor.position.y() * vehicle.Get("y_M", j)) /
                           (vehicle.Get("radius", j) + 1e-9);
      if (std::ranges::find(order, j) != order.end() || (best >= 0 && along <= most)) continue;
      best = j, most = along;
    }
    order.push_back(best);
  }
  return order;
}

NeutralVehicle InLogOrder(const NeutralVehicle& vehicle, const FlightLog& log) {
  NeutralVehicle ordered = vehicle;
  const std::vector<int> order = LogOrder(vehicle, log);
  for (std::size_t i = 0; i < order.size(); ++i) {
    ordered.rotors[i] = vehicle.rotors[static_cast<std::size_t>(order[i])];
  }
  return ordered;
}

NeutralVehicle VehicleOfLog(const FlightLog& log) {
  std::string warning;
  const RotorVehicle stated = VehicleFromLog(log, &warning);
  NeutralVehicle v;
  v.name = log.name;
  v.gravity = log.gravity;
  v.body["m"] = stated.parameters[RotorDrivenModel::kMass];
  for (int k = 0; k < 3; ++k) {
    v.body[std::string("I_") + "xyz"[k]] = stated.parameters[RotorDrivenModel::kInertia + k];
  }
  for (const Rotor& rotor : stated.model.rotors()) {
    v.rotors.push_back({{"x", rotor.position.x()},
                        {"y", rotor.position.y()},
                        {"z", rotor.position.z()},
                        {"spin", rotor.spin},
                        {"k_f", rotor.k_f},
                        {"k_m", rotor.k_m}});
  }
  return v;
}

FlightEstimate EstimateFromFlight(const FlightLog& log, const NeutralVehicle& given) {
  if (log.rotors.empty() && log.motors.empty()) {
    throw ErrorAt(log.directory, 0,
                  "has neither rotor speeds (rotors.csv) nor motor commands (motors.csv)");
  }
  NeutralVehicle start = StartNear(log, given);
  start.gravity = log.gravity;
  // Drag is estimated as a whole, whatever its law in the file: near hover they are one.
  NeutralVehicle fitted = start;
  for (const char* name : {"rotor_speed_drag", "rotor_inflow", "c_x", "c_y", "c_z"}) {
    fitted.body.erase(name);
  }
  const FlightValue lag = log.rotors.empty() ? LagByCommands(log, fitted) : FlightValue();
  RotorCalibrationOptions options = OptionsFor(log, fitted, lag);
  RotorCalibration c = CalibrateRotors(log, options);
  if (std::ranges::find(c.parameters, "at_bound", &ParameterEstimate::status) !=
      c.parameters.end()) {
    // The I_z that is held may be what keeps the others there.
    SetPrior("I_z", fitted.Get("I_z"), kInertiaSigma * fitted.Get("I_z"), &options.prior);
    c = CalibrateRotors(log, options);
    for (const char* name : {"I_x", "I_y"})
      fitted.body[name] = c.batch.mean[FindRotorConstant(name)];
    HoldUsualYaw(&fitted);
    options = OptionsFor(log, fitted, lag);
    c = CalibrateRotors(log, options);
  }

  FlightEstimate estimate;
  estimate.vehicle = fitted;
  estimate.warnings = c.warnings;
  for (const std::string& reason : c.verdict.reasons) estimate.warnings.push_back(reason);
  const auto set = [&](const std::string& name, const FlightValue& value) {
    estimate.values[name] = value;
    if (value.shown) estimate.vehicle.body[name] = value.value;
  };
  for (const char* name : {"r_BM_x", "r_BM_y", "K_x", "K_y", "K_z"}) {
    set(name, ValueOf(c, options.prior, name, 1.0));
  }
  const Eigen::Array3d slopes = SigmaOfSlopes(log, fitted);
  for (const auto& [name, axis] : {std::pair("I_x", 0), std::pair("I_y", 1)}) {
    FlightValue inertia = ValueOf(c, options.prior, name, 1.0);
    inertia.sigma = std::hypot(inertia.sigma, slopes[axis] * inertia.value);
    set(name, inertia);
  }
  FlightValue thrust = ValueOf(c, options.prior, "k_f", fitted.Get("k_f"));
  FlightValue moment = ValueOf(c, options.prior, "k_m", fitted.Get("k_m"));
  const int f = FindRotorConstant("k_f"), m = FindRotorConstant("k_m");
  const double scale_f = c.batch.mean[f], scale_m = c.batch.mean[m];
  const double ratio = moment.value / thrust.value;
  const double relative = c.batch.cov(f, f) / (scale_f * scale_f) +
                          c.batch.cov(m, m) / (scale_m * scale_m) -
                          2.0 * c.batch.cov(f, m) / (scale_f * scale_m);
  const double ratio_sigma =
      std::abs(ratio) *
      std::hypot(Misfit(c) * std::sqrt(std::max(0.0, relative)), kYawByHubs, slopes.z());
  // A moment that could be none is not shown: the yaw of this flight is something else.
  moment.shown = moment.shown && ratio > kClear * ratio_sigma;
  // Beside the I_z that was given: the fit may have held another, and shows k_m / I_z.
  const double held = given.Get("I_z") / fitted.Get("I_z");
  estimate.values["k_m/k_f"] = {held * ratio, held * ratio_sigma, moment.shown};
  for (Numbers& rotor : estimate.vehicle.rotors) {
    rotor["k_f"] *= scale_f;
    if (moment.shown) rotor["k_m"] *= scale_m;
  }
  // The speeds that commands give are the file's: thrust by them is no thrust by speed.
  thrust.shown = thrust.shown && !log.rotors.empty();
  estimate.values["k_f"] = thrust;
  estimate.values["k_m"] = moment;
  if (log.rotors.empty()) {
    set("tau", lag);
  } else if (const auto response = FindMotorResponse(log)) {
    set("tau", {response->lag, response->lag_sigma, true});
    set("full_speed", {response->full_speed, response->full_speed_sigma, true});
  }
  for (const char* name : {"L_v", "M_u"}) {
    estimate.values[name] = ValueOf(c, options.prior, name, 1.0);
  }
  estimate.constants = c.batch.mean;
  estimate.fitted_moment = scale_m * fitted.Get("k_m");
  estimate.noise = c.noise;
  RotorDataOptions data = options.data;
  const RotorData whole = MakeRotorData(log, static_cast<int>(start.rotors.size()), data);
  if (!log.rotors.empty())
    estimate.vehicle.body["S_h"] = whole.measured.speeds.rowwise().sum().mean();
  double squares = 0.0, cubes = 0.0;
  for (const RotorNode& node : RoughNodes(whole, estimate.constants)) {
    const double speed = node.motion.segment<3>(RotorDrivenModel::kVelocity).norm();
    squares += std::pow(speed, 2), cubes += std::pow(speed, 3);
  }
  estimate.vehicle.body["v_m"] = cubes / squares;
  data.start += (1.0 - kHoldOut) * (whole.poses.back().t - whole.poses.front().t);
  estimate.held_out = MakeRotorData(log, static_cast<int>(start.rotors.size()), data);
  return estimate;
}

bool FlightEstimate::Judges(const std::string& name) const {
  if (name == "m") return true;
  const auto value = values.find(name == "I_z" ? "k_m" : name);
  return value != values.end() && value->second.shown;
}

ErrorByHorizon FlightEstimate::ErrorsWith(const NeutralVehicle& other) const {
  // Sensors, biases, moments of the air and what the flight does not judge are those of the fit;
  // the rest is as `other` has it.
  const auto constants_of = [&](const NeutralVehicle& v) {
    RotorConstants x = constants;
    const double sum = (held_out.motors ? v : vehicle).Get("S_h");
    for (const char* name : {"m", "I_x", "I_y", "I_z", "r_BM_x", "r_BM_y", "K_x", "K_y", "K_z"}) {
      if (!Judges(name)) continue;
      double value = v.Get(name);
      if (name[0] == 'K') {
        value -= v.Get(name[2] == 'z' ? "rotor_inflow" : "rotor_speed_drag") * sum +
                 v.Get(std::string("c_") + name[2]) * vehicle.Get("v_m");
      }
      x[FindRotorConstant(name)] = value;
    }
    x[FindRotorConstant("k_f")] = 1.0;
    x[FindRotorConstant("k_m")] = 1.0;
    if (held_out.motors && Judges("tau") && v.Get("tau") > 0.0) {
      x[FindRotorConstant("motor_lag")] = v.Get("tau");
    }
    return x;
  };
  NeutralVehicle flown = other;
  flown.gravity = vehicle.gravity;
  if (held_out.motors) {
    // Thrust by commands is the flight's: a file's k_f goes with speeds that nobody measured.
    const double factor = vehicle.Get("k_f") / flown.Get("k_f");
    for (Numbers& rotor : flown.rotors) rotor["k_f"] *= factor, rotor["k_m"] *= factor;
  }
  const bool yaws = flown.Get("k_m") != 0.0;  // a file may state none
  if (!Judges("k_m") && yaws) {
    const double factor = fitted_moment / flown.Get("k_m");
    for (Numbers& rotor : flown.rotors) rotor["k_m"] *= factor;
  }
  const RotorAeroModel model(RotorVehicleOf(flown).model.rotors(), vehicle.gravity);
  // The filter that gives the starts flies with the flight's own vehicle. Its thrust is counted in
  // the other's rotors, so that one model serves both.
  RotorConstants own = constants;
  own[FindRotorConstant("k_f")] = vehicle.Get("k_f") / flown.Get("k_f");
  own[FindRotorConstant("k_m")] = yaws ? fitted_moment / flown.Get("k_m") : 1.0;
  const std::vector<double> horizons(kHorizons.begin(), kHorizons.end());
  constexpr double kSpacing = 0.2;  // s
  const std::vector<OpenLoopError> errors =
      PredictOpenLoop(model, held_out, noise, own, constants_of(flown), horizons, kSpacing);
  ErrorByHorizon mean{};
  for (std::size_t k = 0; k < kHorizons.size(); ++k) {
    int count = 0;
    for (const OpenLoopError& error : errors) {
      if (error.horizon != kHorizons[k]) continue;
      mean[k] += error.error, ++count;
    }
    mean[k] = count == 0 ? NAN : std::isfinite(mean[k]) ? mean[k] / count : INFINITY;
  }
  return mean;
}

std::map<std::string, FlightValue> Together(const std::vector<FlightEstimate>& flights) {
  std::map<std::string, FlightValue> together;
  for (const auto& [name, first] : flights.front().values) {
    std::vector<FlightValue> shown;
    for (const FlightEstimate& flight : flights) {
      const auto value = flight.values.find(name);
      if (value != flight.values.end() && value->second.shown) shown.push_back(value->second);
    }
    FlightValue& value = together[name] = first;
    if (shown.empty()) continue;
    double weights = 0.0, sum = 0.0, scatter = 0.0;
    for (const FlightValue& one : shown) {
      const double weight = 1.0 / (one.sigma * one.sigma);
      weights += weight, sum += weight * one.value;
    }
    value.value = sum / weights, value.sigma = std::sqrt(1.0 / weights), value.shown = true;
    for (const FlightValue& one : shown)
      scatter += std::pow((one.value - value.value) / one.sigma, 2);
    const double freedom = static_cast<double>(shown.size()) - 1.0;
    if (freedom > 0.0) value.sigma *= std::sqrt(std::max(1.0, scatter / freedom));
  }
  return together;
}

}  // namespace trueline
