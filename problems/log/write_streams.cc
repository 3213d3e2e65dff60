#include "problems/log/write_streams.h"

#include <fmt/format.h>

#include "problems/common/atomic_file.h"
#include "problems/log/csv_text.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

using Buffer = fmt::memory_buffer;

constexpr std::size_t kFlushAt = 1 << 16;  // bytes
constexpr char kPoseHeader[] = "t [s],x [m],y [m],z [m],qw [1],qx [1],qy [1],qz [1]";

void Append(double value, Buffer* out) { fmt::format_to(std::back_inserter(*out), ",{}", value); }

void Append(const Eigen::Vector3d& vector, Buffer* out) {
  for (const double value : vector) Append(value, out);
}

void Append(const Eigen::Quaterniond& q, Buffer* out) {
  for (const double value : {q.w(), q.x(), q.y(), q.z()}) Append(value, out);
}

void AppendSample(const ImuSample& sample, Buffer* out) {
  Append(sample.accel, out);
  Append(sample.gyro, out);
}

void AppendSample(const AttitudeSample& sample, Buffer* out) { Append(sample.q_Ep_I, out); }

void AppendSample(const Fix& fix, Buffer* out) {
  Append(fix.p_E, out);
  Append(fix.sigma, out);
  fmt::format_to(std::back_inserter(*out), ",{}", fix.gate);
}

void AppendSample(const PoseSample& pose, Buffer* out) {
  Append(pose.p_E, out);
  Append(pose.q_E, out);
}

void AppendSample(const ChannelsSample& sample, Buffer* out) {
  for (const double value : sample.values) Append(value, out);
}

void AppendSample(const ScalarSample& sample, Buffer* out) { Append(sample.value, out); }

template <class Sample>
void WriteStream(const std::vector<Sample>& samples, const std::string& header,
                 const fs::path& path) {
  if (samples.empty()) {
    fs::remove(path);
    return;
  }
  AtomicFile file(path);
  file.stream() << header << '\n';
  Buffer buffer;
  const auto flush = [&] {
    file.stream().write(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    buffer.clear();
  };
  for (const Sample& sample : samples) {
    buffer.append(TimeText(sample.t));
    AppendSample(sample, &buffer);
    buffer.push_back('\n');
    if (buffer.size() > kFlushAt) flush();
  }
  flush();
  file.Commit();
}

std::string ChannelsHeader(const std::vector<ChannelsSample>& samples, const std::string& prefix,
                           const std::string& unit) {
  std::string header = "t [s]";
  const std::size_t count = samples.empty() ? 0 : samples.front().values.size();
  for (std::size_t k = 1; k <= count; ++k) header += fmt::format(",{}{} [{}]", prefix, k, unit);
  return header;
}

}  // namespace

void WriteStreams(const FlightLog& log, const fs::path& directory) {
  WriteStream(log.imu, "t [s],ax [m/s^2],ay [m/s^2],az [m/s^2],gx [rad/s],gy [rad/s],gz [rad/s]",
              directory / "imu.csv");
  WriteStream(log.attitude, "t [s],qw [1],qx [1],qy [1],qz [1]", directory / "attitude.csv");
  WriteStream(log.fixes, "t [s],x [m],y [m],z [m],sigma [m],gate [1]", directory / "fixes.csv");
  WriteStream(log.pose, kPoseHeader, directory / "pose.csv");
  WriteStream(log.mocap, kPoseHeader, directory / "mocap.csv");
  WriteStream(log.rotors, ChannelsHeader(log.rotors, "w", "rad/s"), directory / "rotors.csv");
  WriteStream(log.motors, ChannelsHeader(log.motors, "u", "1"), directory / "motors.csv");
  WriteStream(log.battery, "t [s],voltage [V]", directory / "battery.csv");
  WriteStream(log.range, "t [s],range [m]", directory / "range.csv");
}

}  // namespace trueline
