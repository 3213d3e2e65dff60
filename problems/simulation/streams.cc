#include "problems/simulation/streams.h"

#include <algorithm>
#include <cmath>

#include "problems/common/random.h"
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

}  // namespace trueline::simulation
