#include "problems/inspection/repair.h"

#include <algorithm>

#include "problems/import/shared_stamps.h"
#include "problems/inspection/examination.h"
#include "problems/log/samples.h"

namespace trueline {
namespace {

template <class Samples>
void LeaveOut(const StreamRepair& repair, const Stream& stream, Samples* samples) {
  std::erase_if(*samples, [&](const auto& sample) { return IsWithin(repair.leave_out, sample.t); });
  if (!repair.only_new) return;
  // As `new_where`: the first row may be of any age.
  std::vector<double> before;
  if (!samples->empty()) before = NumbersOf(stream, samples->front());
  std::erase_if(*samples, [&](const auto& sample) {
    std::vector<double> now = NumbersOf(stream, sample);
    const bool same = now == before;
    before = std::move(now);
    return same;
  });
}

// Of what a sample has: force and rates, an attitude, a position, channels.
void RepairSample(const StreamRepair& repair, const FileAttitude& file, auto* sample) {
  if constexpr (requires { sample->accel; }) {
    sample->accel = repair.accel_scale * (repair.accel * sample->accel);
    sample->gyro = repair.gyro_scale * (repair.gyro * sample->gyro);
  }
  if constexpr (requires { sample->q_Ep_I; }) sample->q_Ep_I = Reread(sample->q_Ep_I, repair, file);
  if constexpr (requires { sample->q_E; }) sample->q_E = Reread(sample->q_E, repair, file);
  if constexpr (requires { sample->p_E; }) {
    sample->p_E = repair.position_scale * (repair.position * sample->p_E);
  }
  if constexpr (requires { sample->values; }) {
    const std::vector<double> old = sample->values;
    for (std::size_t i = 0; i < old.size(); ++i) {
      sample->values[i] = repair.channel_scale * old[repair.order.empty() ? i : repair.order[i]];
    }
  }
}

// What the accelerometer reads becomes the body's specific force, by the log's attitude.
void MakeForce(const StreamRepair& repair, const FileAttitudes& sources, FlightLog* log) {
  if (repair.force_by.empty()) return;
  const Eigen::Matrix3d to_earth = EarthFromBodyAsRead(sources, repair.force_by);
  const std::vector<AttitudeSample> attitude = AttitudesOf(*log, repair.force_by);
  AttitudeCursor cursor(attitude);
  Eigen::Quaterniond q = attitude.front().q_Ep_I;
  for (ImuSample& sample : log->imu) {
    cursor.At(sample.t, kAttitudeGap, &q);
    if (repair.force_in_earth) sample.accel = q.conjugate() * to_earth * sample.accel;
    sample.accel.noalias() -=
        q.conjugate() * Eigen::Vector3d(0.0, 0.0, repair.gravity_removed * log->gravity);
  }
}

}  // namespace

Eigen::Matrix3d EarthFromBodyAsRead(const FileAttitudes& sources, const std::string& stream) {
  const auto own = sources.find(stream);
  if (own == sources.end()) return Eigen::Matrix3d::Identity();
  return own->second.axes.earth * own->second.axes.body.transpose();
}

bool IsWithin(const std::vector<Stretch>& stretches, TimeNs t) {
  return std::any_of(stretches.begin(), stretches.end(),
                     [t](const Stretch& stretch) { return stretch.Holds(t); });
}

bool IsIdentity(const Eigen::Matrix3d& m) { return m.isIdentity(1e-12); }

bool StreamRepair::IsNone() const {
  const bool same_order = quaternion == std::array<int, 4>{0, 1, 2, 3} && !inverse && order.empty();
  return same_order && angle_order.empty() && force_by.empty() && time_offset == 0.0 &&
         std::ranges::all_of(kTurnsOfRepair, [&](auto turn) { return IsIdentity(this->*turn); }) &&
         std::ranges::all_of(kScalesOfRepair, [&](auto scale) { return this->*scale == 1.0; }) &&
         leave_out.empty() && !only_new;
}

bool Repairs::IsNone() const {
  return !reverse_spins && std::all_of(streams.begin(), streams.end(),
                                       [](const auto& entry) { return entry.second.IsNone(); });
}

Eigen::Quaterniond Reread(const Eigen::Quaterniond& q, const StreamRepair& repair,
                          const FileAttitude& file) {
  const Eigen::Quaterniond to_earth(file.axes.earth), to_body(file.axes.body);
  const Eigen::Quaterniond read = to_earth.conjugate() * q * to_body;
  const std::array<double, 4> c = {read.w(), read.x(), read.y(), read.z()};
  const auto at = [&](std::size_t i) { return c[static_cast<std::size_t>(repair.quaternion[i])]; };
  Eigen::Quaterniond right(at(0), at(1), at(2), at(3));
  if (!repair.angle_order.empty()) {
    right = TurnBy(repair.angle_factor.cwiseProduct(AnglesOf(read, file.form)), repair.angle_order);
  }
  if (repair.inverse) right = right.conjugate();
  return (Eigen::Quaterniond(repair.earth) * to_earth * right * to_body.conjugate() *
          Eigen::Quaterniond(repair.body).conjugate())
      .normalized();
}

void ApplyRepair(const std::string& stream, const StreamRepair& repair,
                 const FileAttitudes& sources, FlightLog* log) {
  Repairs alone;
  alone.streams[stream] = repair;
  ApplyRepairs(alone, sources, log);
}

void ApplyRepairs(const Repairs& repairs, const FileAttitudes& sources, FlightLog* log) {
  ForEachStream(*log, [&](const Stream& stream, auto& samples) {
    const auto found = repairs.streams.find(stream.name);
    if (found == repairs.streams.end()) return;
    const auto own = sources.find(stream.name);
    const FileAttitude file = own == sources.end() ? FileAttitude{} : own->second;
    LeaveOut(found->second, stream, &samples);
    for (auto& sample : samples) {
      sample.t += FromSeconds(found->second.time_offset);
      RepairSample(found->second, file, &sample);
    }
    if constexpr (std::is_same_v<SampleOf<decltype(samples)>, ImuSample>)
      MakeForce(found->second, sources, log);
  });
  if (!repairs.reverse_spins || !log->vehicle) return;
  for (Rotor& rotor : log->vehicle->rotors) rotor.spin = -rotor.spin;
}

}  // namespace trueline
