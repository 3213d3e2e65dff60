#include "problems/simulation/streams.h"

#include <algorithm>
#include <cmath>

#include "problems/common/random.h"
#include "problems/common/units.h"
#include "problems/common/yaml_archive.h"

namespace trueline::simulation {
namespace {

void SampleMocap(const SensorInstant& now, FlightLog* log) {
  const TruePose pose = now.truth.At(now.t);
  log->mocap.push_back(MeasurePose(now.t, pose.p_E, pose.q_E_B, now.settings.at("position_sigma"),
                                   now.settings.at("attitude_sigma"), now.random));
}

// Measured rotor speeds, and the commands as a share of the greatest speed.
void SampleRotors(const SensorInstant& now, FlightLog* log) {
  const VehicleConfig& vehicle = now.config.vehicle;
  if (!log->vehicle) log->vehicle = Vehicle{vehicle.mass, vehicle.rotors};
  const TruthSample& truth = now.truth.Nearest(now.t);
  ChannelsSample speeds{FromSeconds(now.t), {}}, commands{FromSeconds(now.t), {}};
  for (const double w : truth.rotors) {
    speeds.values.push_back(w + now.settings.at("sigma") * now.random->Normal());
  }
  for (const double w : truth.command) commands.values.push_back(w / vehicle.max_rotor_speed);
  log->rotors.push_back(speeds);
  log->motors.push_back(commands);
}

// Distance to the floor along B's z axis.
void SampleRange(const SensorInstant& now, FlightLog* log) {
  const TruePose pose = now.truth.At(now.t);
  const double slant = (pose.q_E_B * Vector3d::UnitZ()).z();
  const double noise = now.settings.at("sigma") * now.random->Normal();
  log->range.push_back({FromSeconds(now.t), -pose.p_E.z() / std::max(slant, 0.1) + noise});
}

}  // namespace

const std::vector<SensorDefinition>& SampledSensors() {
  static const std::vector<SensorDefinition> sensors = {
      {"mocap",
       {{"rate", "Hz", 120.0}, {"position_sigma", "m", 0.001}, {"attitude_sigma", "rad", 0.002}},
       SampleMocap},
      {"rotors", {{"rate", "Hz", 0.0}, {"sigma", "rad/s", 0.0}}, SampleRotors},
      {"range", {{"rate", "Hz", 0.0}, {"sigma", "m", 0.01}}, SampleRange},
  };
  return sensors;
}

SensorSettings DefaultSensors() {
  SensorSettings settings;
  for (const SensorDefinition& sensor : SampledSensors()) {
    for (const EffectParameter& p : sensor.parameters) settings[sensor.id][p.name] = *p.fallback;
  }
  return settings;
}

void Serialize(YamlArchive* a, SensorSettings* sensors) {
  for (const SensorDefinition& sensor : SampledSensors()) {
    a->Map(sensor.id, [numbers = &(*sensors)[sensor.id]](YamlArchive* map) {
      for (auto& [name, value] : *numbers) map->NotNegative(name, &value);
    });
  }
}

void LogSensors(const SimulationConfig& config, const Trajectory& truth, std::uint64_t seed,
                FlightLog* log) {
  for (const SensorDefinition& sensor : SampledSensors()) {
    const std::map<std::string, double>& settings = config.sensors.at(sensor.id);
    if (settings.at("rate") <= 0.0) continue;
    Random random(seed, sensor.id);
    for (const double t : StreamTimes(settings.at("rate"), config.duration)) {
      sensor.sample({t, config, settings, truth, &random}, log);
    }
  }
}

void LogAttitude(const SimulationConfig& config, const Stages& stages, const Trajectory& truth,
                 FlightLog* log) {
  double latency = 0.0;
  Apply(stages.attitude_latency, &latency);
  const double rate = config.ahrs.rate > 0.0 ? config.ahrs.rate : config.imu.rate;
  for (const double t : StreamTimes(rate, config.duration)) {
    log->attitude.push_back({FromSeconds(t), truth.At(t - latency).q_Ep_I});
  }
}

// Errors of a receiver that no Gauss-Markov process describes: they swing, jump and are outliers.
class StrayErrors {
 public:
  StrayErrors(const GnssConfig& gnss, std::uint64_t seed)
      : gnss_(gnss), random_(seed, "gnss_stray") {
    for (int i = 0; i < 3; ++i) phase_[i] = random_.Uniform(-M_PI, M_PI);
  }

  // At a fix; call it for each fix in turn.
  Vector3d Next(double t) {
    if (random_.Uniform(0.0, 1.0) < 1.0 / (gnss_.rate * gnss_.jump_interval)) {
      jumps_ += gnss_.jump * random_.NormalVector3();
    }
    Vector3d error = jumps_;
    for (int i = 0; i < 3; ++i) {
      error[i] += gnss_.wave * std::sin(2.0 * M_PI * t / gnss_.wave_period + phase_[i]);
    }
    const Vector3d outlier = gnss_.outlier_size * random_.NormalVector3();
    return random_.Uniform(0.0, 1.0) < gnss_.outlier_share ? Vector3d(error + outlier) : error;
  }
  double Delay() { return gnss_.latency_jitter * random_.NormalVector3().x(); }

 private:
  const GnssConfig& gnss_;
  Random random_;
  Vector3d phase_ = Vector3d::Zero(), jumps_ = Vector3d::Zero();
};

void LogGnss(const SimulationConfig& config, const Stages& stages, const Trajectory& truth,
             std::uint64_t seed, FlightLog* log) {
  const GnssConfig& gnss = config.gnss;
  double latency = gnss.latency;
  Apply(stages.fix_latency, &latency);
  OrnsteinUhlenbeck slow(Vector3d::Constant(gnss.sigma), gnss.correlation_time, seed, "gnss_slow");
  Random white(seed, "gnss_white");
  StrayErrors stray(gnss, seed);
  log->gates.clear();
  log->fixes.clear();
  for (const double t : StreamTimes(gnss.rate, config.duration)) {
    const Vector3d error = slow.value() + gnss.white_sigma * white.NormalVector3() + stray.Next(t);
    const double then = t - latency - stray.Delay();
    log->fixes.push_back({FromSeconds(t), truth.At(then).p_E + error, gnss.stated_sigma, -1});
    slow.Advance(1.0 / gnss.rate);
  }
}

PoseSample MeasurePose(double t, const Vector3d& p_E, const Quaterniond& q_E, double position_sigma,
                       double attitude_sigma, Random* random) {
  const Vector3d shift = position_sigma * random->NormalVector3();
  const Vector3d turn = attitude_sigma * random->NormalVector3();
  return {FromSeconds(t), p_E + shift, q_E * RotationByVector(turn)};
}

void LowPassGyro(double cutoff, std::vector<ImuSample>* imu) {
  const double period =
      SecondsBetween(imu->front().t, imu->back().t) / static_cast<double>(imu->size() - 1);
  const double w = std::tan(M_PI * cutoff * period);  // pre-warped
  const double scale = 1.0 / (1.0 + std::sqrt(2.0) * w + w * w);
  const double a1 = 2.0 * (w * w - 1.0) * scale, a2 = (1.0 - std::sqrt(2.0) * w + w * w) * scale;
  Eigen::Vector3d in1 = imu->front().gyro, in2 = in1, out1 = in1, out2 = in1;
  for (ImuSample& s : *imu) {
    const Eigen::Vector3d out = w * w * scale * (s.gyro + 2.0 * in1 + in2) - a1 * out1 - a2 * out2;
    in2 = in1, in1 = s.gyro, out2 = out1, out1 = out;
    s.gyro = out;
  }
}

void StampLater(double delay, std::vector<ChannelsSample>* samples) {
  for (ChannelsSample& s : *samples) s.t += FromSeconds(delay);
}

namespace {

constexpr double kShortestView = 0.1;  // s, and the longest gap within a view

}  // namespace

GateCamera::GateCamera(const DetectorConfig& config, const std::vector<Gate>& map,
                       const Stages& stages, std::uint64_t seed)
    : config_(config),
      map_(map),
      stages_(stages),
      latency_(config.latency),
      times_(seed, "fix_times"),
      noise_(seed, "fix_noise"),
      outliers_(seed, "fix_outliers"),
      jitter_(seed, "fix_jitter"),
      false_gates_(seed, "false_gates") {
  for (const Gate& gate : map_) {
    standing_.push_back(gate.position);
    Apply(stages_.gate, gate.id, &standing_.back());
  }
  Apply(stages_.fix_latency, &latency_);
}

bool GateCamera::Sees(const TruthSample& sample, int gate) const {
  const Vector3d u_E = standing_[gate] - sample.p_E;
  const double distance = u_E.norm();
  if (distance < config_.range_min || distance > config_.range_max) return false;
  const double yaw = map_[gate].yaw;
  const double through = (u_E.x() * std::cos(yaw) + u_E.y() * std::sin(yaw)) / distance;
  if (through < std::cos(config_.max_view_deg * kDegree)) return false;
  const Vector3d u_B = sample.q_E_B.conjugate() * u_E;
  const Vector3d u_C =
      Eigen::AngleAxisd(-config_.camera_pitch_deg * kDegree, Vector3d::UnitY()) * u_B;
  return std::abs(std::atan2(u_C.y(), u_C.x())) < 0.5 * config_.fov_horizontal_deg * kDegree &&
         std::abs(std::atan2(u_C.z(), u_C.x())) < 0.5 * config_.fov_vertical_deg * kDegree;
}

int GateCamera::VisibleGate(const TruthSample& sample) const {
  int nearest = -1;
  for (int i = 0; i < static_cast<int>(map_.size()); ++i) {
    if (!Sees(sample, i)) continue;
    const auto distance = [&](int gate) { return (standing_[gate] - sample.p_E).norm(); };
    if (nearest < 0 || distance(i) < distance(nearest)) nearest = i;
  }
  return nearest;
}

std::vector<GateView> GateCamera::Views(const Trajectory& truth) const {
  std::vector<GateView> views;
  for (const TruthSample& sample : truth.samples()) {
    if (sample.t < 0.0) continue;
    const int gate = VisibleGate(sample);
    if (gate < 0) continue;
    if (!views.empty() && views.back().gate == gate &&
        sample.t - views.back().end < kShortestView) {
      views.back().end = sample.t;
    } else {
      views.push_back({gate, sample.t, sample.t});
    }
  }
  std::erase_if(views, [](const GateView& v) { return v.end - v.start < kShortestView; });
  return views;
}

// Outliers are drawn for every fix, so that enabling them changes no other random number.
Vector3d GateCamera::Noise(double sigma) {
  const bool outlier = outliers_.Bernoulli(config_.outlier_share);
  Vector3d wrong;
  for (double& axis : wrong) axis = outliers_.Uniform(-config_.outlier_size, config_.outlier_size);
  if (outlier) return wrong;
  if (config_.tail_dof <= 0.0) return sigma * noise_.NormalVector3();
  Vector3d noise;
  for (double& axis : noise) axis = sigma * noise_.StudentT(config_.tail_dof);
  return noise;
}

// Fix = map position - R_E_B * measured vector + noise: errors of map, vector and attitude all
// enter the fix.
Fix GateCamera::Measure(const Trajectory& truth, int gate, double t) {
  const TruePose pose = truth.At(t);
  Vector3d object_E = standing_[gate];
  Apply(stages_.false_gate, map_[gate].id, &false_gates_, &object_E);
  Vector3d u_B = pose.q_E_B.conjugate() * (object_E - pose.p_E);
  const double distance = (standing_[gate] - pose.p_E).norm();
  Apply(stages_.gate_vector, &u_B);
  const Quaterniond& turn = config_.turned_by_ahrs ? pose.q_Ep_I : pose.q_E_B;
  Fix fix;
  fix.sigma = std::max(config_.sigma_floor, config_.sigma_factor * distance);
  fix.p_E = map_[gate].position - turn * u_B + Noise(fix.sigma);
  fix.gate = map_[gate].id;
  fix.t = FromSeconds(t + latency_ + config_.jitter * jitter_.Normal());
  return fix;
}

std::vector<Fix> GateCamera::Fixes(const Trajectory& truth) {
  std::vector<Fix> fixes;
  for (const GateView& view : Views(truth)) {
    const int most = std::max(1, static_cast<int>((view.end - view.start) * config_.max_rate));
    const int wanted = times_.UniformInt(config_.fixes_min, config_.fixes_max);
    std::vector<double> times(std::min(wanted, most));
    for (double& t : times) t = times_.Uniform(view.start, view.end);
    std::sort(times.begin(), times.end());
    for (const double t : times) fixes.push_back(Measure(truth, view.gate, t));
  }
  std::sort(fixes.begin(), fixes.end(), [](const Fix& a, const Fix& b) { return a.t < b.t; });
  const auto same = [](const Fix& a, const Fix& b) { return a.t == b.t; };
  fixes.erase(std::unique(fixes.begin(), fixes.end(), same), fixes.end());
  return fixes;
}

}  // namespace trueline::simulation
