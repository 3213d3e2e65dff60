// One flight in memory, as in a native log (SI units, NED earth E, FRD body B).
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "cost_functions/models/rigid_body.h"
#include "problems/common/units.h"

namespace trueline {

// What a stream's declaration says of a field of its samples. Reader, writer, importer and tables
// derive from the declarations in flight_log.h.
enum class FrameAxes { kNone, kEarth, kBody };

inline constexpr int kNoGate = -1;  // of a fix that no gate gave
inline constexpr int kMostId = 1'000'000'000;
inline constexpr double kLeastSigma = 1e-6;  // m; no detector is better, and weights stay finite

struct Field {
  const char* key;                          // in a column map; "": the stream's own keys
  std::array<const char*, 4> columns = {};  // of the CSV file; null after the last one
  const char* unit = "1";                   // SI; units.cc lists the units that it converts
  FrameAxes axes = FrameAxes::kNone;        // of a vector: an importer turns foreign axes to these
  bool is_sigma = false;                    // a standard deviation: kLeastSigma or more
};

inline constexpr Field kAttitudeField{"", {"qw", "qx", "qy", "qz"}};

// The file NAME.csv of a native log, and the key NAME under `streams` in a column map.
struct Stream {
  const char* name;
  Field value = {""};  // where the sample is one number, or channels (numbered from 1)
};

// Every stream keeps its own rate; stamps are strictly increasing within a stream. Describe() calls
// the archive with each field and its value, in the order of the columns after `t`. A new stream
// needs a sample type with its Describe() and a line in ForEachStream(); to be simulated, also an
// entry in problems/simulation/streams.cc.
struct ImuSample {
  TimeNs t;
  Eigen::Vector3d accel;  // m/s^2, specific force in the IMU frame I; level and at rest z is -9.81
  Eigen::Vector3d gyro;   // rad/s, in I

  template <class Archive, class Self>
  static void Describe(Archive& archive, Self& self, const Stream&) {
    archive(Field{"accel", {"ax", "ay", "az"}, "m/s^2", FrameAxes::kBody}, self.accel);
    archive(Field{"gyro", {"gx", "gy", "gz"}, "rad/s", FrameAxes::kBody}, self.gyro);
  }
};

struct AttitudeSample {
  TimeNs t;
  Eigen::Quaterniond q_Ep_I;  // takes a vector in I to the AHRS's own earth frame E'

  template <class Archive, class Self>
  static void Describe(Archive& archive, Self& self, const Stream&) {
    archive(kAttitudeField, self.q_Ep_I);
  }
};

struct Fix {
  TimeNs t;
  Eigen::Vector3d p_E;  // m
  double sigma;         // m, the detector's own 1-sigma figure for each axis
  int gate;             // id of the gate seen

  template <class Archive, class Self>
  static void Describe(Archive& archive, Self& self, const Stream&) {
    archive(Field{"position", {"x", "y", "z"}, "m", FrameAxes::kEarth}, self.p_E);
    archive(Field{"sigma", {"sigma"}, "m", FrameAxes::kNone, true}, self.sigma);
    archive(Field{"gate", {"gate"}}, self.gate);
  }
};

// Pose of a frame in E: mocap gives that of B, a pose sensor that of its own frame P.
struct PoseSample {
  TimeNs t;
  Eigen::Vector3d p_E;     // m
  Eigen::Quaterniond q_E;  // takes a vector in the sensor's frame to E

  template <class Archive, class Self>
  static void Describe(Archive& archive, Self& self, const Stream&) {
    archive(Field{"position", {"x", "y", "z"}, "m", FrameAxes::kEarth}, self.p_E);
    archive(kAttitudeField, self.q_E);
  }
};

struct ChannelsSample {
  TimeNs t;
  std::vector<double> values;  // rotor speeds in rad/s, or motor commands in [0, 1]

  template <class Archive, class Self>
  static void Describe(Archive& archive, Self& self, const Stream& stream) {
    archive(stream.value, self.values);
  }
};

struct ScalarSample {
  TimeNs t;
  double value;  // V for battery, m for range

  template <class Archive, class Self>
  static void Describe(Archive& archive, Self& self, const Stream& stream) {
    archive(stream.value, self.value);
  }
};

struct Gate {
  int id;
  Eigen::Vector3d position;  // m, in E
  double yaw;                // rad, flight direction through the gate
};

struct Vehicle {
  std::optional<double> mass;  // kg
  std::vector<Rotor> rotors;
};

struct FlightLog {
  std::string name;
  double gravity = 9.81;    // m/s^2
  std::string environment;  // indoors: the air is still; outdoors; empty: not stated
  std::vector<Gate> gates;
  std::optional<Vehicle> vehicle;
  // What an importer read: dataset, file, sha256, and for each stream of a recording its channel.
  std::map<std::string, std::string> source;

  std::vector<ImuSample> imu;
  std::vector<AttitudeSample> attitude;
  std::vector<Fix> fixes;
  std::vector<PoseSample> pose;
  std::vector<PoseSample> mocap;
  std::vector<ChannelsSample> rotors;
  std::vector<ChannelsSample> motors;
  std::vector<ScalarSample> battery;
  std::vector<ScalarSample> range;

  // Filled by the reader, ignored by the writer.
  std::string directory;
  std::map<std::string, std::string> sha256;  // by file name
  std::vector<std::string> warnings;          // what was treated, and how
};

// Calls visit(stream, samples) for every stream of a log, filled or empty.
template <class Log, class Visit>
void ForEachStream(Log& log, const Visit& visit) {
  visit(Stream{"imu"}, log.imu);
  visit(Stream{"attitude"}, log.attitude);
  visit(Stream{"fixes"}, log.fixes);
  visit(Stream{"pose"}, log.pose);
  visit(Stream{"mocap"}, log.mocap);
  visit(Stream{"rotors", {"", {"w"}, "rad/s"}}, log.rotors);
  visit(Stream{"motors", {"", {"u"}}}, log.motors);
  visit(Stream{"battery", {"", {"voltage"}, "V"}}, log.battery);
  visit(Stream{"range", {"", {"range"}, "m"}}, log.range);
}

template <class Samples>
using SampleOf = typename std::remove_cvref_t<Samples>::value_type;

}  // namespace trueline
