#include "problems/rotor/rotor_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"

namespace trueline {
namespace {

constexpr double kShortest = 1.0;  // s

// Replaces commanded speeds, held from one sample to the next, by the speeds of rotors with a
// first-order lag.
void Follow(double lag, RotorData* data) {
  std::vector<double> command = data->speeds.front();
  for (std::size_t i = 1; i < data->speeds.size(); ++i) {
    const double left = std::exp(-(data->speed_times[i] - data->speed_times[i - 1]) / lag);
    const std::vector<double>& before = data->speeds[i - 1];
    std::vector<double>& speeds = data->speeds[i];
    for (std::size_t r = 0; r < speeds.size(); ++r) {
      const double next = speeds[r];
      speeds[r] = command[r] + left * (before[r] - command[r]);
      command[r] = next;
    }
  }
}

Eigen::MatrixXd ToMatrix(const std::vector<std::vector<double>>& speeds) {
  Eigen::MatrixXd matrix(speeds.size(), speeds.front().size());
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    matrix.row(i) = Eigen::RowVectorXd::Map(speeds[i].data(), matrix.cols());
  }
  return matrix;
}

// rad/s/sqrt(Hz), of the noise of samples at these times.
double DensityOf(const SpeedModel& model, const std::vector<double>& t) {
  if (model.sigma == 0.0) return 0.0;
  return model.sigma * std::sqrt((t.back() - t.front()) / static_cast<double>(t.size() - 1));
}

// Battery voltage (V) at `t`: linear between readings, constant outside.
double VoltageAt(const std::vector<ScalarSample>& battery, TimeNs t) {
  const auto after = std::ranges::upper_bound(battery, t, {}, &ScalarSample::t);
  if (after == battery.begin()) return battery.front().value;
  if (after == battery.end()) return battery.back().value;
  const ScalarSample &a = *(after - 1), &b = *after;
  return a.value + (b.value - a.value) * SecondsBetween(a.t, t) / SecondsBetween(a.t, b.t);
}

MotorCommands CommandsOf(const FlightLog& log, const MotorCurve& curve, TimeNs from, TimeNs to) {
  MotorCommands motors{curve, {}, {}};
  for (const ChannelsSample& s : log.motors) {
    if (s.t < from) continue;
    motors.commands.push_back(s.values);
    motors.voltages.push_back(log.battery.empty() ? curve.nominal_voltage
                                                  : VoltageAt(log.battery, s.t));
    const double most = *std::ranges::max_element(s.values);
    if (s.t <= to && most > 0.0 && !(motors.voltages.back() > 0.0)) {
      throw ErrorAt(log.directory + "/battery.csv", 0,
                    fmt::format("holds {} V at {:.3f} s, where a motor turns; cut the log to where "
                                "the battery is measured",
                                motors.voltages.back(), SecondsBetween(log.imu.front().t, s.t)));
    }
  }
  return motors;
}

// The estimate clamped to values that motors can have.
MotorValues Possible(const MotorValues& estimate) {
  constexpr double kShortestLag = 1e-3;  // s
  MotorValues at = estimate;
  at[kLag] = std::max(at[kLag], kShortestLag);
  at[kIdle] = std::min(at[kIdle], 0.95);
  return at;
}

void CheckSource(const FlightLog& log, const RotorDataOptions& options) {
  constexpr char kHow[] =
      "state how commands turn the motors: --config with `motors` (config/calibrate/rotors.yaml)";
  if (options.rotors == RotorSource::kRotors) {
    if (!log.rotors.empty()) return;
    if (log.motors.empty()) {
      throw ErrorAt(log.directory, 0,
                    "has neither rotors.csv nor motors.csv; --drive=rotors needs rotor speeds or "
                    "motor commands beside imu.csv");
    }
    throw ErrorAt(log.directory, 0, fmt::format("has no rotors.csv. To take motors.csv, {}", kHow));
  }
  if (log.motors.empty()) {
    throw ErrorAt(log.directory, 0, "has no motors.csv; leave `motors` out to use rotors.csv");
  }
  if (!options.motors) throw ErrorAt(log.directory, 0, kHow);
  if (log.battery.empty() && options.motors_at[kVoltage] != 0.0) {
    throw ErrorAt(log.directory, 0,
                  "has no battery.csv; set motors: {voltage: 0}, so that commands alone count");
  }
  if (!(options.motors_at[kLag] + options.motor_lag > 0.0)) {
    throw ErrorAt(log.directory, 0, "the motors' lag must be above 0 s; set motors: {lag: 0.03}");
  }
}

void CheckStreams(const FlightLog& log, int rotors, const std::vector<PoseSample>& poses,
                  const char* pose_file, const RotorDataOptions& options) {
  CheckSource(log, options);
  const bool motors = options.rotors == RotorSource::kMotors;
  const std::size_t columns = (motors ? log.motors : log.rotors).front().values.size();
  if (static_cast<int>(columns) != rotors) {
    throw ErrorAt(log.directory + (motors ? "/motors.csv" : "/rotors.csv"), 0,
                  fmt::format("has {} columns, the vehicle {} rotors; list each rotor in vehicle",
                              columns, rotors));
  }
  if (poses.size() < 2) {
    throw ErrorAt(
        log.directory, 0,
        fmt::format("has no {}; choose the other of pose and mocap by fit_to", pose_file));
  }
}

struct Span {
  TimeNs begin, end;
};

// The time that all streams cover, cut as the options say.
Span SpanOf(const FlightLog& log, const std::vector<PoseSample>& poses,
            const std::vector<ChannelsSample>& drive, const RotorDataOptions& options) {
  Span span{std::max({log.imu.front().t, poses.front().t, drive.front().t}),
            std::min({log.imu.back().t, poses.back().t, drive.back().t})};
  span.begin += FromSeconds(options.start);
  span.end -= FromSeconds(options.end);
  if (options.duration > 0.0) {
    span.end = std::min(span.end, span.begin + FromSeconds(options.duration));
  }
  if (SecondsBetween(span.begin, span.end) < kShortest) {
    throw ErrorAt(log.directory, 0,
                  fmt::format("imu, rotors and poses overlap by {:.2f} s; {} s are needed",
                              SecondsBetween(span.begin, span.end), kShortest));
  }
  return span;
}

void AddImuAndPoses(const FlightLog& log, const std::vector<PoseSample>& poses, const Span& span,
                    const RotorDataOptions& options, RotorData* data) {
  const auto within = [&](TimeNs t) { return t >= span.begin && t <= span.end; };
  for (const ImuSample& s : log.imu) {
    if (within(s.t)) data->imu.push_back({SecondsBetween(span.begin, s.t), s.accel, s.gyro});
  }
  double next = 0.0;
  for (const PoseSample& s : poses) {
    const double t = SecondsBetween(span.begin, s.t);
    if (!within(s.t) || t < next) continue;
    data->poses.push_back({t, s.p_E, s.q_E.normalized()});
    next = t + 0.8 / options.pose_rate;
  }
  if (data->imu.size() < 2 || data->poses.size() < 2) {
    throw ErrorAt(
        log.directory, 0,
        fmt::format("has {} IMU samples and {} poses in {:.2f} s of the flight; a stream "
                    "has a gap there, choose another part by start and end",
                    data->imu.size(), data->poses.size(), SecondsBetween(span.begin, span.end)));
  }
  if (options.gyro_delay != 0.0) DelayGyro(log, options.gyro_delay, data);
}

}  // namespace

const RotorPose* PoseNear(const RotorData& data, double t) {
  constexpr double kEarlier = 0.005, kLater = 0.02;  // s
  constexpr double kUneven = 1.1;                    // of the mean time between poses
  const double spacing =
      (data.poses.back().t - data.poses.front().t) / static_cast<double>(data.poses.size() - 1);
  const auto next = std::ranges::lower_bound(data.poses, t - kEarlier, {}, &RotorPose::t);
  const double latest = t + std::max(kLater, kUneven * spacing);
  return next != data.poses.end() && next->t < latest ? &*next : nullptr;
}

void RotorData::SetSpeeds(const Eigen::MatrixXd& smooth) {
  for (Eigen::Index i = 0; i < smooth.rows(); ++i) {
    for (Eigen::Index r = 0; r < smooth.cols(); ++r) speeds[i][r] = smooth(i, r);
  }
  if (speed_lag > 0.0) Follow(speed_lag, this);
}

RotorInput RotorData::InputAt(double t) const {
  const auto after = std::upper_bound(speed_times.begin(), speed_times.end(), t);
  std::size_t i = after - speed_times.begin();
  double share = 1.0;
  if (after == speed_times.begin()) {
    if (speed_times.size() > 1) ++i, share = 0.0;
  } else if (after == speed_times.end()) {
    --i;
  } else {
    share = (t - speed_times[i - 1]) / (speed_times[i] - speed_times[i - 1]);
  }
  const std::size_t before = i == 0 ? 0 : i - 1;
  RotorInput input{t + since_start, std::vector<double>(speeds[i].size())};
  for (std::size_t r = 0; r < input.speeds.size(); ++r) {
    input.speeds[r] = (1.0 - share) * speeds[before][r] + share * speeds[i][r];
  }
  if (i != before) {
    const double dt = speed_times[i] - speed_times[before];
    const bool within = t >= speed_times.front() && t <= speed_times.back();
    input.accelerations.resize(input.speeds.size());
    for (std::size_t r = 0; r < input.speeds.size(); ++r) {
      input.accelerations[r] = within ? (speeds[i][r] - speeds[before][r]) / dt : 0.0;
    }
  }
  if (slopes.empty()) return input;
  input.motors = motors_at;
  input.slopes.resize(input.speeds.size());
  for (std::size_t r = 0; r < input.slopes.size(); ++r) {
    input.slopes[r] = (1.0 - share) * slopes[before][r] + share * slopes[i][r];
  }
  return input;
}

PoseError ErrorOf(const RotorPose& pose, const RotorNoise& noise) {
  return {pose.p_E, pose.q_E_P, noise.position, noise.attitude};
}

void RotorData::SimulateMotors(const MotorValues& at) {
  motors_at = Possible(at);
  const double lag = motors_at[kLag] + added_lag;
  speeds = motors->commands;  // only to give `speeds` the same shape
  slopes.assign(speeds.size(), std::vector<MotorValues>(speeds.front().size()));
  for (std::size_t r = 0; r < speeds.front().size(); ++r) {
    const auto steady = [&](std::size_t i) {
      return SteadySpeed(motors->curve, motors_at, motors->commands[i][r], motors->voltages[i]);
    };
    MotorSpeed speed = steady(0);
    for (std::size_t i = 0; i < speeds.size(); ++i) {
      if (i > 0) speed = AfterLag(speed, steady(i - 1), lag, speed_times[i] - speed_times[i - 1]);
      speeds[i][r] = speed.value;
      slopes[i][r] = speed.slope;
    }
  }
}

void DelayGyro(const FlightLog& log, double delay, RotorData* data) {
  auto after = log.imu.begin();
  for (RotorImu& row : data->imu) {
    const TimeNs t = data->origin + FromSeconds(row.t + delay);
    while (after != log.imu.end() && after->t <= t) ++after;
    if (after == log.imu.begin() || after == log.imu.end()) {
      row.gyro = after == log.imu.begin() ? after->gyro : log.imu.back().gyro;
      continue;
    }
    const ImuSample& before = *(after - 1);
    const double share = SecondsBetween(before.t, t) / SecondsBetween(before.t, after->t);
    row.gyro = (1.0 - share) * before.gyro + share * after->gyro;
  }
}

RotorData MakeRotorData(const FlightLog& log, int rotors, const RotorDataOptions& options) {
  const bool mocap = options.source == PoseSource::kMocap;
  const std::vector<PoseSample>& poses = mocap ? log.mocap : log.pose;
  CheckStreams(log, rotors, poses, mocap ? "mocap.csv" : "pose.csv", options);
  const bool commands = options.rotors == RotorSource::kMotors;
  const std::vector<ChannelsSample>& drive = commands ? log.motors : log.rotors;
  const Span span = SpanOf(log, poses, drive, options);
  RotorData data;
  data.origin = span.begin;
  data.since_start = SecondsBetween(log.imu.front().t, span.begin);
  data.attitude = options.attitude;
  AddImuAndPoses(log, poses, span, options, &data);
  // Before the flight the motors may idle, where speeds have another noise.
  const TimeNs from = span.begin - FromSeconds(kShortest);
  for (const ChannelsSample& s : drive) {
    if (s.t < from) continue;
    data.speed_times.push_back(SecondsBetween(span.begin, s.t) + options.rotor_delay);
    data.speeds.push_back(s.values);
  }
  if (commands) {
    data.motors = CommandsOf(log, *options.motors, from, span.end);
    data.added_lag = options.motor_lag;
    data.SimulateMotors(options.motors_at);
    return data;
  }
  MeasuredSpeeds& measured = data.measured;
  measured.speeds = ToMatrix(data.speeds);
  if (options.smooth_rotors) {
    measured.model =
        options.speeds ? *options.speeds : LearnSpeedModel(data.speed_times, measured.speeds);
  }
  if (options.weigh_speed_noise) data.speed_density = DensityOf(measured.model, data.speed_times);
  data.speed_lag = options.motor_lag;
  data.SetSpeeds(SmoothSpeeds(data.speed_times, measured.speeds, measured.model));
  return data;
}

namespace {

constexpr double kHalfSlope = 0.05;  // s
constexpr double kHalfMean = 0.01;   // s

Eigen::Vector3d MeanGyro(const RotorData& data, double t) {
  auto first = std::ranges::lower_bound(data.imu, t - kHalfMean, {}, &RotorImu::t);
  auto last = std::ranges::lower_bound(data.imu, t + kHalfMean, {}, &RotorImu::t);
  if (first == last) {  // a gap: use the next sample, or the last one
    if (first == data.imu.end()) --first;
    last = first + 1;
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (auto sample = first; sample != last; ++sample) sum += sample->gyro;
  return sum / static_cast<double>(last - first);
}

// Index of the last pose not after `t`.
int PoseBefore(const RotorData& data, double t) {
  const auto after = std::ranges::upper_bound(data.poses, t, {}, &RotorPose::t);
  return std::max(0, static_cast<int>(after - data.poses.begin()) - 1);
}

}  // namespace

std::vector<RotorNode> RoughNodes(const RotorData& data, const RotorConstants& constants) {
  const int count = static_cast<int>(data.poses.size());
  const auto constant = [&](int index) -> Eigen::Vector3d {
    return constants.segment<3>(index - RotorAeroModel::kMoving);
  };
  const Eigen::Vector3d arm =
      constant(RotorDrivenModel::kPoseArm) - constant(RotorDrivenModel::kCentre);
  std::vector<RotorNode> nodes;
  nodes.reserve(count);
  for (const RotorPose& pose : data.poses) {
    RotorNode node;
    node.motion.head<4>() << pose.q_E_P.w(), pose.q_E_P.vec();
    node.motion.segment<3>(RotorDrivenModel::kPosition) = pose.p_E - pose.q_E_P * arm;
    node.motion.segment<3>(RotorDrivenModel::kRate) =
        MeanGyro(data, pose.t) - constant(RotorDrivenModel::kGyroBias);
    nodes.push_back(node);
  }
  for (int i = 0; i < count; ++i) {
    const double t = data.poses[i].t;
    const int a = std::min(i, std::max(PoseBefore(data, t - kHalfSlope), 0));
    const int b =
        std::max(std::min(PoseBefore(data, t + kHalfSlope), count - 1), std::min(a + 1, count - 1));
    const int from = a == b ? b - 1 : a;
    nodes[i].motion.segment<3>(RotorDrivenModel::kVelocity) =
        (nodes[b].motion.segment<3>(RotorDrivenModel::kPosition) -
         nodes[from].motion.segment<3>(RotorDrivenModel::kPosition)) /
        (data.poses[b].t - data.poses[from].t);
  }
  return nodes;
}

}  // namespace trueline
