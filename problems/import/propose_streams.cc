#include "problems/import/propose_streams.h"

#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>

#include "problems/import/field_groups.h"
#include "problems/import/formats/open_recording.h"
#include "problems/log/csv_text.h"
#include "problems/log/units.h"

namespace trueline {
namespace {

using Texts = std::vector<std::string>;

// Numbers of this size tell units apart that no name states.
constexpr double kLargestG = 3.0;      // mean specific force of a flight in g; in m/s^2 about 10
constexpr double kFastestRate = 60.0;  // rad/s; gyroscopes end at 2000 deg/s = 35 rad/s
constexpr double kLargestAngle = 6.5;  // rad
constexpr double kLeastVerticalShare = 0.5;  // of the mean specific force, along z

bool Mentions(const std::string& stem, const Texts& words) {
  return std::any_of(words.begin(), words.end(),
                     [&](const std::string& word) { return stem.find(word) != std::string::npos; });
}

// The fields of these parts; empty if one is missing.
Texts PartsOf(const FieldGroup& group, const Texts& parts) {
  Texts fields;
  for (const std::string& part : parts) {
    const auto found = group.parts.find(part);
    if (found == group.parts.end()) return {};
    fields.push_back(found->second);
  }
  return fields;
}

Texts ThreeOf(const FieldGroup& group) {
  const Texts xyz = PartsOf(group, {"x", "y", "z"});
  return xyz.empty() ? PartsOf(group, {"[0]", "[1]", "[2]"}) : xyz;
}

// Three columns of a map, with the unit that their names state.
struct Vector {
  Texts columns;  // empty for none
  std::string_view unit;
};

// The first vector whose name has one of the words.
Vector VectorOf(const std::vector<FieldGroup>& groups, const Texts& words) {
  for (const FieldGroup& group : groups) {
    const Texts three = ThreeOf(group);
    if (three.empty() || group.parts.contains("w") || !Mentions(group.stem, words)) continue;
    if (!Mentions(group.stem, {"cov", "var", "bias", "offset"})) return {three, group.unit};
  }
  return {};
}

// The vector of short names, such as ax, ay, az.
Vector ShortVectorOf(const std::vector<FieldGroup>& groups, const Texts& stems) {
  for (const std::string& stem : stems) {
    for (const FieldGroup& group : groups) {
      const Texts three = ThreeOf(group);
      if (group.stem == stem && !three.empty() && !group.parts.contains("w")) {
        return {three, group.unit};
      }
    }
  }
  return {};
}

Vector AccelerometerOf(const std::vector<FieldGroup>& groups) {
  Vector named = VectorOf(groups, {"acc", "a_rs"});
  return named.columns.empty() ? ShortVectorOf(groups, {"a", "a_", "f", "f_"}) : named;
}

Vector GyroscopeOf(const std::vector<FieldGroup>& groups) {
  Vector named = VectorOf(groups, {"gyr", "angular_vel", "omega", "w_rs"});
  if (!named.columns.empty()) return named;
  Vector short_name = ShortVectorOf(groups, {"g", "g_", "w", "w_"});
  if (!short_name.columns.empty()) return short_name;
  for (const FieldGroup& group : groups) {
    Texts rates = PartsOf(group, {"p", "q", "r"});
    if (group.stem.empty() && !rates.empty()) return {rates, group.unit};
  }
  return {};
}

// Bare x, y and z are a position where a file holds nothing else, or its channel says so.
Vector PositionOf(const std::vector<FieldGroup>& groups, bool may_be_bare) {
  Vector named = VectorOf(groups, {"pos", "transl", "p_rs", "point"});
  if (!named.columns.empty()) return named;
  Vector short_name = ShortVectorOf(groups, {"p", "p_", "t", "t_"});
  if (!short_name.columns.empty() || !may_be_bare) return short_name;
  return ShortVectorOf(groups, {""});
}

// w, x, y, z, or numbers from 0 on, where w usually comes first.
Texts QuaternionOf(const std::vector<FieldGroup>& groups) {
  for (const FieldGroup& group : groups) {
    Texts named = PartsOf(group, {"w", "x", "y", "z"});
    if (!named.empty()) return named;
    const bool is_attitude = group.stem == "q" || group.stem.ends_with("_q") ||
                             group.stem.ends_with(".q") ||
                             Mentions(group.stem, {"quat", "orient", "q_"});
    if (!is_attitude) continue;
    const Texts numbered = PartsOf(group, {"0", "1", "2", "3"});
    if (!numbered.empty()) return numbered;
    const Texts listed = PartsOf(group, {"[0]", "[1]", "[2]", "[3]"});
    if (!listed.empty()) return listed;
  }
  return {};
}

// --- The size of numbers

struct Sizes {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double largest = 0.0;
};

// Of three columns; rows that lack one are left out.
Sizes SizesOf(Recording* recording, std::size_t channel, const Texts& columns) {
  std::array<std::size_t, 3> at{};
  for (std::size_t i = 0; i < 3; ++i) {
    at[i] = static_cast<std::size_t>(recording->channels()[channel].IndexOf(columns[i]));
  }
  Sizes sizes;
  double count = 0.0;
  recording->Visit({channel}, [&](std::size_t, const Record& record) {
    const Eigen::Vector3d row(record.cells[at[0]].Number(), record.cells[at[1]].Number(),
                              record.cells[at[2]].Number());
    if (!row.allFinite()) return;
    sizes.largest = std::max(sizes.largest, row.cwiseAbs().maxCoeff());
    sizes.mean += (row - sizes.mean) / ++count;
  });
  return sizes;
}

// --- Lines of a map

std::string Quoted(const Texts& columns) {
  Texts quoted;
  for (const std::string& column : columns) quoted.push_back(fmt::format("\"{}\"", column));
  return fmt::format("{}", fmt::join(quoted, ", "));
}

std::string ColumnsText(const Texts& columns, std::string_view unit) {
  return fmt::format("columns: [{}], unit: {}", Quoted(columns), unit);
}

// The unit that names state, if it is one of `si`; else `guess`.
std::string_view UnitOf(std::string_view stated, std::string_view si, std::string_view guess) {
  return UnitFactor(si, stated) ? stated : guess;
}

std::string AttitudeText(const Channel& channel, std::size_t place, Recording* recording) {
  const Texts q = QuaternionOf(GroupsOf(channel));
  if (!q.empty()) {
    return fmt::format("quaternion: {{w: \"{}\", x: \"{}\", y: \"{}\", z: \"{}\"}}", q[0], q[1],
                       q[2], q[3]);
  }
  const FieldGroup group = EulerAnglesOf(channel);
  const Texts angles = PartsOf(group, {"roll", "pitch", "yaw"});
  if (angles.empty()) return "";
  const bool large = SizesOf(recording, place, angles).largest > kLargestAngle;
  return fmt::format("euler: {{roll: \"{}\", pitch: \"{}\", yaw: \"{}\", unit: {}}}", angles[0],
                     angles[1], angles[2], UnitOf(group.unit, "rad", large ? "deg" : "rad"));
}

// The streams of one channel.
class ChannelProposal {
 public:
  ChannelProposal(Recording* recording, std::size_t channel, ProposedStreams* streams)
      : recording_(recording),
        place_(channel),
        channel_(recording->channels()[channel]),
        groups_(GroupsOf(channel_)),
        is_csv_(recording->format().key == std::string(kCsvFormat)),
        streams_(streams) {
    if (!is_csv_) from_ = fmt::format("channel: \"{}\", ", channel_.Label());
  }

  void Add() {
    AddImu();
    AddPositionAndAttitude();
    AddBattery();
  }

 private:
  void AddLine(const char* stream, const std::string& text, const std::string& comment = "") {
    streams_->lines.try_emplace(stream, fmt::format("{}: {{{}{}}}{}{}", stream, from_, text,
                                                    comment.empty() ? "" : "  # ", comment));
  }

  void AddImu() {
    const Vector accel = AccelerometerOf(groups_);
    const Vector gyro = GyroscopeOf(groups_);
    if (accel.columns.empty() || gyro.columns.empty() || streams_->lines.contains("imu")) return;
    const Eigen::Vector3d force = SizesOf(recording_, place_, accel.columns).mean;
    const bool fast = SizesOf(recording_, place_, gyro.columns).largest > kFastestRate;
    const bool in_g = force.norm() > 0.0 && force.norm() < kLargestG;
    const bool stated =
        UnitFactor("m/s^2", accel.unit).has_value() && UnitFactor("rad/s", gyro.unit).has_value();
    AddLine("imu",
            fmt::format(
                "accel: {{{}}}, gyro: {{{}}}",
                ColumnsText(accel.columns, UnitOf(accel.unit, "m/s^2", in_g ? "g" : "m/s^2")),
                ColumnsText(gyro.columns, UnitOf(gyro.unit, "rad/s", fast ? "deg/s" : "rad/s"))),
            stated ? "" : "units by the size of the numbers; or m/s^2, g, rad/s, deg/s");
    streams_->is_z_up = force.z() > kLeastVerticalShare * force.norm();
  }

  // A pose is that of mocap; a position alone is that of fixes.
  void AddPositionAndAttitude() {
    const std::string attitude = AttitudeText(channel_, place_, recording_);
    const bool may_be_bare =
        is_csv_ || Mentions(LowerCase(channel_.name), {"pos", "odom", "traj", "track"});
    const Vector position = PositionOf(groups_, may_be_bare);
    if (position.columns.empty()) {
      if (!attitude.empty()) AddLine("attitude", attitude);
      return;
    }
    const std::string columns = fmt::format(
        "position: {{{}}}", ColumnsText(position.columns, UnitOf(position.unit, "m", "m")));
    if (attitude.empty()) {
      AddLine("fixes", columns + ", sigma: {constant: 0.05}", "state its standard deviation, m");
    } else {
      AddLine("mocap", columns + ", " + attitude, "if truth");
    }
  }

  void AddBattery() {
    for (const ChannelField& field : channel_.fields) {
      const std::string name = LowerCase(field.name);
      if (!name.starts_with("volt") && !name.starts_with("vbat")) continue;
      AddLine("battery", fmt::format("column: \"{}\", unit: V", field.name));
    }
  }

  Recording* recording_;
  std::size_t place_;
  const Channel channel_;
  std::vector<FieldGroup> groups_;
  bool is_csv_;
  ProposedStreams* streams_;
  std::string from_;
};

}  // namespace

ProposedStreams ProposeStreams(Recording* recording) {
  std::vector<std::size_t> channels;
  for (std::size_t i = 0; i < recording->channels().size(); ++i) {
    if (recording->channels()[i].count > 0) channels.push_back(i);
  }
  std::stable_partition(channels.begin(), channels.end(), [&](std::size_t i) {
    return !IsSetpointOrEstimate(recording->channels()[i].name);
  });
  ProposedStreams streams;
  for (const std::size_t i : channels) ChannelProposal(recording, i, &streams).Add();
  return streams;
}

}  // namespace trueline
