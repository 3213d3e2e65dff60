#include "problems/observability/flight_from_log.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "problems/common/error.h"
#include "problems/observability/imu_driven_system.h"
#include "problems/vgd/drive_track.h"

namespace trueline {
namespace {

using Vector = Eigen::VectorXd;

// Values at time stamps, linear between them, constant outside.
class Curve {
 public:
  void Add(TimeNs t, Vector value) {
    times_.push_back(ToSeconds(t));
    values_.push_back(std::move(value));
  }
  bool empty() const { return times_.empty(); }
  double start() const { return times_.front(); }
  double end() const { return times_.back(); }
  Vector At(double t) const {
    const auto after = std::upper_bound(times_.begin(), times_.end(), t) - times_.begin();
    if (after == 0) return values_.front();
    if (after == static_cast<std::ptrdiff_t>(times_.size())) return values_.back();
    const double share = (t - times_[after - 1]) / (times_[after] - times_[after - 1]);
    return (1.0 - share) * values_[after - 1] + share * values_[after];
  }
  // Mean over the samples within `half` seconds to reduce noise; linear interpolation if there are
  // none.
  Vector Smooth(double t, double half) const {
    const auto first = std::lower_bound(times_.begin(), times_.end(), t - half) - times_.begin();
    const auto last = std::upper_bound(times_.begin(), times_.end(), t + half) - times_.begin();
    if (last <= first) return At(t);
    Vector sum = Vector::Zero(values_.front().size());
    for (auto i = first; i < last; ++i) sum += values_[i];
    return sum / static_cast<double>(last - first);
  }

 private:
  std::vector<double> times_;
  std::vector<Vector> values_;
};

Vector Coefficients(const Eigen::Quaterniond& q) {
  return Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
}

// Quaternions with signs chosen for continuity, so that they can be interpolated linearly.
template <class Samples, class Get>
Curve AttitudeCurve(const Samples& samples, const Get& get) {
  Curve curve;
  Vector before = Eigen::Vector4d(1, 0, 0, 0);
  for (const auto& sample : samples) {
    Vector q = Coefficients(get(sample));
    if (q.dot(before) < 0.0) q = -q;
    curve.Add(sample.t, q);
    before = q;
  }
  return curve;
}

Curve BestAttitude(const FlightLog& log) {
  const auto pose = [](const PoseSample& sample) { return sample.q_E; };
  if (!log.mocap.empty()) return AttitudeCurve(log.mocap, pose);
  if (!log.pose.empty()) return AttitudeCurve(log.pose, pose);
  return AttitudeCurve(log.attitude, [](const AttitudeSample& s) { return s.q_Ep_I; });
}

[[noreturn]] void Refuse(const FlightLog& log, const std::string& message) {
  throw ErrorAt(log.directory, 0, message);
}

NominalFlight Between(const FlightLog& log, double start, double end) {
  if (!(end - start > 1.0)) Refuse(log, "the streams overlap by less than 1 s; nothing to observe");
  NominalFlight flight;
  flight.start = start;
  flight.end = end;
  return flight;
}

}  // namespace

NominalFlight RotorFlightFromLog(const FlightLog& log, const RotorVehicle& vehicle) {
  if (log.rotors.empty()) Refuse(log, "has no rotors.csv; rotor speeds are needed for this model");
  const int rotors = vehicle.model.num_rotors();
  auto speeds = std::make_shared<Curve>();
  for (const ChannelsSample& sample : log.rotors) {
    if (static_cast<int>(sample.values.size()) != rotors) {
      Refuse(log, fmt::format("rotors.csv has {} speeds, the vehicle {} rotors",
                              sample.values.size(), rotors));
    }
    speeds->Add(sample.t, Eigen::Map<const Vector>(sample.values.data(), rotors));
  }
  auto attitude = std::make_shared<Curve>(BestAttitude(log));
  if (attitude->empty())
    Refuse(log, "has no attitude; mocap.csv, pose.csv or attitude.csv is needed");
  auto rates = std::make_shared<Curve>();
  for (const ImuSample& sample : log.imu) rates->Add(sample.t, sample.gyro);
  NominalFlight flight =
      Between(log, std::max({speeds->start(), attitude->start(), rates->start()}),
              std::min({speeds->end(), attitude->end(), rates->end()}));
  flight.at = [=, parameters = vehicle.parameters](double t) {
    using Model = RotorDrivenModel;
    NominalPoint point{parameters, {}};
    const Vector q = attitude->At(t).normalized(), w = rates->Smooth(t, 0.005), n = speeds->At(t);
    for (int i = 0; i < 4; ++i) point.x[Model::kAttitude + i] = q[i];
    for (int i = 0; i < 3; ++i) point.x[Model::kRate + i] = w[i];
    for (int i = 0; i < rotors; ++i) point.u.push_back(n[i] * n[i]);
    return point;
  };
  return flight;
}

namespace {

// The attitude that drives the model: the log's, or that of the program's own filter, whose heading
// starts at zero.
std::vector<AttitudeSample> DrivingAttitude(const FlightLog& log) {
  return log.attitude.empty() ? RunComplementaryFilter(log.imu, {}) : log.attitude;
}

std::vector<PositionReading> PositionsOf(const FlightLog& log) {
  std::vector<PositionReading> positions;
  for (const PoseSample& sample : log.mocap) {
    positions.push_back({sample.t, sample.p_E, kMocapSigma});
  }
  if (!positions.empty()) return positions;
  for (const Fix& fix : log.fixes) positions.push_back({fix.t, fix.p_E, fix.sigma});
  return positions;
}

}  // namespace

NominalFlight ImuFlightFromLog(const FlightLog& log) {
  const std::vector<PositionReading> positions = PositionsOf(log);
  if (positions.empty()) Refuse(log, "has neither fixes.csv nor mocap.csv; positions are needed");
  const std::vector<AttitudeSample> samples = DrivingAttitude(log);
  if (samples.empty()) Refuse(log, "has neither attitude.csv nor imu.csv; attitude is needed");
  const auto attitude = std::make_shared<Curve>(
      AttitudeCurve(samples, [](const AttitudeSample& sample) { return sample.q_Ep_I; }));
  auto accel = std::make_shared<Curve>();
  for (const ImuSample& sample : log.imu) accel->Add(sample.t, sample.accel.tail<1>());
  if (accel->empty()) Refuse(log, "has no imu.csv, which drives this model");
  const double first = ToSeconds(positions.front().t), last = ToSeconds(positions.back().t);
  NominalFlight flight = Between(log, std::max({attitude->start(), accel->start(), first}),
                                 std::min({attitude->end(), accel->end(), last}));
  const auto path =
      std::make_shared<const SmoothedPath>(SmoothPath(log.imu, samples, positions, log.gravity));
  flight.at = [attitude, accel, path](double t) {
    using ImuSystem = ImuDrivenSystem;
    NominalPoint point{ImuSystem::Typical(), {}};
    point.x[ImuSystem::kParameters + kAhrsInTheta + 2] = path->heading;
    const Eigen::Vector3d v_E = path->VelocityAt(t);
    const Vector q = attitude->At(t).normalized();
    for (int i = 0; i < 3; ++i) point.x[ImuSystem::kVelocity + i] = v_E[i];
    const Eigen::Matrix3d R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
    for (int i = 0; i < 9; ++i) point.u.push_back(R(i / 3, i % 3));
    point.u.push_back(accel->Smooth(t, 0.02)[0]);
    return point;
  };
  return flight;
}

}  // namespace trueline
