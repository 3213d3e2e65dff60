// Columns of a stream that stop changing while the other columns of the same sensor go on.
#pragma once

#include <string>
#include <vector>

#include "problems/inspection/repair.h"
#include "problems/log/flight_log.h"

namespace trueline {

// The columns of one sensor (accelerometer, gyroscope, orientation, position); their neighbours
// tell whether the vehicle moves.
struct Sensor {
  std::vector<const char*> names;
  std::vector<std::vector<double>> columns;
};
struct StreamColumns {
  std::vector<TimeNs> t;
  std::vector<Sensor> sensors;  // none of channels and single numbers
};

// Archive that appends a sample's numbers to its sensors.
struct ColumnCollector {
  std::vector<Sensor>& sensors;
  std::size_t next = 0;

  void operator()(const Field& field, const Eigen::Vector3d& v) { Add(field, {v[0], v[1], v[2]}); }
  void operator()(const Field& field, const Eigen::Quaterniond& q) {
    Add(field, {q.w(), q.x(), q.y(), q.z()});
  }
  void operator()(const Field&, const auto&) {}
  void Add(const Field& field, const std::vector<double>& values);
};
template <class Sample>
StreamColumns ColumnsOf(const Stream& stream, const std::vector<Sample>& samples) {
  StreamColumns columns;
  for (const Sample& sample : samples) {
    columns.t.push_back(sample.t);
    ColumnCollector collect{columns.sensors};
    Sample::Describe(collect, sample, stream);
  }
  return columns;
}

struct StuckColumn {
  std::string column;
  double value = 0.0;
  std::size_t count = 0;  // samples in a row
  Stretch stretch;
};

// The least step between different values, if the others are its multiples; 0 for a column that is
// not coarse.
double QuantumOf(const std::vector<double>& values);

// The longest stretch of each column that no ordinary signal makes. A vehicle at rest, a coarse
// signal or a coordinate that never changes is not stuck: the stretch is compared with how often
// the column repeats elsewhere, and how often its neighbours repeat meanwhile. A coarse column must
// also differ by more than one step of its values before or after the stretch.
std::vector<StuckColumn> FindStuck(const StreamColumns& stream);

// All stretches over which no number of a stream changes and that no ordinary repeats make, in the
// order of time: a tracker that has lost the vehicle, a driver that hangs, or a vehicle at rest.
std::vector<Stretch> FindFrozen(const StreamColumns& stream);

// rad, all turns of the gyroscope within the stretch added up.
double TurnOfGyro(const FlightLog& log, const Stretch& stretch);
// Whether that is more than a vehicle at rest turns.
bool TurnsMeanwhile(const FlightLog& log, const Stretch& stretch);

// The columns of each sensor that keeps one value in all of at least kFewest samples, as "gx, gy
// and gz".
std::vector<std::string> FindDead(const StreamColumns& stream);

// Channels, from 0, that have one value in all of at least kFewest samples.
std::vector<std::size_t> StillChannels(const std::vector<ChannelsSample>& samples);

// Rows of positions that are no measurement: what a tracker says while it does not see the vehicle.

enum class Lost {
  kZero,     // exactly 0 0 0, beside others that are far from there
  kHeld,     // a pose or position that keeps one value while the vehicle moves
  kFlipped,  // a pose of other body axes, which a tracker takes from another set of markers
};

struct LostTrack {
  std::string stream;
  Lost how = Lost::kZero;
  std::vector<Stretch> stretches;

  double Seconds() const;
  std::string Text() const;  // one sentence, with all places
};

// In mocap, pose and fixes, by stream and kind.
std::vector<LostTrack> FindLostTracks(const FlightLog& log);

// Removes these rows from the log, and returns a warning for each stream and kind.
std::vector<std::string> LeaveOutLostTracks(FlightLog* log);

}  // namespace trueline
