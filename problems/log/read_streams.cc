#include "problems/log/read_streams.h"

#include <cmath>
#include <functional>

#include "problems/common/error.h"
#include "problems/common/sha256.h"
#include "problems/log/stream_reader.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

constexpr double kNormTolerance = 1e-2;  // of a quaternion written with three decimals

const std::vector<Column> kImuColumns = {
    {"ax", Dimension::kAcceleration}, {"ay", Dimension::kAcceleration},
    {"az", Dimension::kAcceleration}, {"gx", Dimension::kAngularRate},
    {"gy", Dimension::kAngularRate},  {"gz", Dimension::kAngularRate}};
const std::vector<Column> kAttitudeColumns = {{"qw", Dimension::kNone},
                                              {"qx", Dimension::kNone},
                                              {"qy", Dimension::kNone},
                                              {"qz", Dimension::kNone}};
const std::vector<Column> kFixColumns = {{"x", Dimension::kLength},
                                         {"y", Dimension::kLength},
                                         {"z", Dimension::kLength},
                                         {"sigma", Dimension::kLength},
                                         {"gate", Dimension::kNone}};
const std::vector<Column> kPoseColumns = {{"x", Dimension::kLength}, {"y", Dimension::kLength},
                                          {"z", Dimension::kLength}, {"qw", Dimension::kNone},
                                          {"qx", Dimension::kNone},  {"qy", Dimension::kNone},
                                          {"qz", Dimension::kNone}};

Eigen::Vector3d ReadVector(const StreamReader& reader, int first) {
  return {reader.value(first), reader.value(first + 1), reader.value(first + 2)};
}

// The quaternion in columns first .. first + 3, normalised; false if the row is truncated.
bool ReadQuaternion(StreamReader* reader, int first, Eigen::Quaterniond* q) {
  *q = Eigen::Quaterniond(reader->value(first), reader->value(first + 1), reader->value(first + 2),
                          reader->value(first + 3));
  const double norm = q->norm();
  if (std::abs(norm - 1.0) > kNormTolerance) {
    if (reader->DropAsCutOff()) return false;
    reader->Fail("qw",
                 fmt::format("the quaternion's norm is {:.6g}, not 1; remove the row or check "
                             "the order of the columns",
                             norm));
  }
  // A norm that is correct to the last digits stays, so that reading returns what was written.
  if (std::abs(norm - 1.0) > 1e-12) q->normalize();
  return true;
}

bool ParseFix(StreamReader* reader, Fix* fix) {
  *fix = {reader->time(), ReadVector(*reader, 0), reader->value(3), 0};
  if (fix->sigma <= 0.0) {
    reader->Fail("sigma",
                 fmt::format("found {}; a standard deviation must be positive", reader->value(3)));
  }
  const double gate = reader->value(4);
  if (gate != std::floor(gate) || std::abs(gate) > 1e9) {
    reader->Fail("gate", fmt::format("found {}; a gate id is a whole number", gate));
  }
  fix->gate = static_cast<int>(gate);
  return true;
}

bool ParsePose(StreamReader* reader, PoseSample* pose) {
  pose->t = reader->time();
  pose->p_E = ReadVector(*reader, 0);
  return ReadQuaternion(reader, 3, &pose->q_E);
}

// Reads all rows; `convert` returns false for a last row that is cut off.
template <class Sample>
std::vector<Sample> ReadRows(StreamReader* reader, const fs::path& path,
                             const std::function<bool(StreamReader*, Sample*)>& convert) {
  std::vector<Sample> samples;
  while (reader->Next()) {
    if (samples.empty()) samples.reserve(reader->EstimatedRows());
    Sample sample{};
    if (!convert(reader, &sample)) break;
    samples.push_back(std::move(sample));
  }
  if (samples.empty()) {
    throw ErrorAt(path.string(), 0,
                  "has a header but no rows; record the stream or remove the file");
  }
  return samples;
}

// A stream file of a log: absent ones are skipped; digests of read ones are stored.
class Streams {
 public:
  Streams(const fs::path& directory, FlightLog* log) : directory_(directory), log_(log) {}

  template <class Sample>
  void Read(const std::string& name, const std::vector<Column>& columns,
            const std::function<bool(StreamReader*, Sample*)>& convert,
            std::vector<Sample>* samples) {
    const fs::path path = directory_ / name;
    if (!fs::exists(path)) return;
    StreamReader reader(path, columns, &log_->warnings);
    *samples = ReadRows(&reader, path, convert);
    log_->sha256[name] = Sha256OfFile(path);
  }

  void ReadChannels(const std::string& name, const std::string& prefix, Dimension dimension,
                    std::vector<ChannelsSample>* samples) {
    const fs::path path = directory_ / name;
    if (!fs::exists(path)) return;
    StreamReader reader(path, prefix, dimension, &log_->warnings);
    *samples = ReadRows<ChannelsSample>(&reader, path, [](StreamReader* row, ChannelsSample* s) {
      *s = {row->time(), row->values()};
      return true;
    });
    log_->sha256[name] = Sha256OfFile(path);
  }

 private:
  fs::path directory_;
  FlightLog* log_;
};

bool ParseImu(StreamReader* reader, ImuSample* sample) {
  *sample = {reader->time(), ReadVector(*reader, 0), ReadVector(*reader, 3)};
  return true;
}

bool ParseAttitude(StreamReader* reader, AttitudeSample* sample) {
  sample->t = reader->time();
  return ReadQuaternion(reader, 0, &sample->q_Ep_I);
}

bool ParseScalar(StreamReader* reader, ScalarSample* sample) {
  *sample = {reader->time(), reader->value(0)};
  return true;
}

}  // namespace

void ReadStreams(const fs::path& directory, FlightLog* log) {
  if (!fs::exists(directory / "imu.csv")) {
    throw ErrorAt((directory / "imu.csv").string(), 0,
                  "is missing; every log needs 't [s],ax [m/s^2],ay,az,gx [rad/s],gy,gz'");
  }
  Streams streams(directory, log);
  streams.Read<ImuSample>("imu.csv", kImuColumns, ParseImu, &log->imu);
  streams.Read<AttitudeSample>("attitude.csv", kAttitudeColumns, ParseAttitude, &log->attitude);
  streams.Read<Fix>("fixes.csv", kFixColumns, ParseFix, &log->fixes);
  streams.Read<PoseSample>("pose.csv", kPoseColumns, ParsePose, &log->pose);
  streams.Read<PoseSample>("mocap.csv", kPoseColumns, ParsePose, &log->mocap);
  streams.ReadChannels("rotors.csv", "w", Dimension::kAngularRate, &log->rotors);
  streams.ReadChannels("motors.csv", "u", Dimension::kNone, &log->motors);
  streams.Read<ScalarSample>("battery.csv", {{"voltage", Dimension::kVoltage}}, ParseScalar,
                             &log->battery);
  streams.Read<ScalarSample>("range.csv", {{"range", Dimension::kLength}}, ParseScalar,
                             &log->range);
  if (log->fixes.empty() && log->mocap.empty() && log->pose.empty()) {
    throw ErrorAt(
        directory.string(), 0,
        "has neither fixes.csv nor mocap.csv, nor pose.csv; add position fixes from gate "
        "detections, a ground truth that fixes can be sampled from, or a pose sensor's output");
  }
}

}  // namespace trueline
