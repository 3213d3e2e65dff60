// Columns of a stream that stop changing while the other columns of the same sensor go on.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

struct StuckColumn {
  std::string column;
  double value = 0.0;
  std::size_t count = 0;           // samples in a row
  double from = 0.0, until = 0.0;  // s
};

struct FrozenStretch {
  TimeNs from = 0, until = 0;
};

// The least step between different values, if the others are its multiples; 0 for a column that is
// not coarse.
double QuantumOf(const std::vector<double>& values);

// Of every sample type of ForEachStream(). The longest stretch of each column of IMU, attitude and
// positions that no ordinary signal makes. A vehicle at rest, a coarse signal or a coordinate that
// never changes is not stuck: the stretch is compared with how often the column repeats elsewhere,
// and how often its neighbours repeat meanwhile. A coarse column must also differ by more than one
// step of its values before or after the stretch.
template <class Sample>
std::vector<StuckColumn> FindStuck(const Stream& stream, const std::vector<Sample>& samples);

// All stretches over which no number of a stream changes and that no ordinary repeats make, in the
// order of time: a tracker that has lost the vehicle, a driver that hangs, or a vehicle at rest.
template <class Sample>
std::vector<FrozenStretch> FindFrozen(const Stream& stream, const std::vector<Sample>& samples);

// Whether the gyroscope turns within the stretch, by more than a vehicle at rest.
bool TurnsMeanwhile(const FlightLog& log, const FrozenStretch& frozen);

// The columns of each sensor of a stream (accelerometer, gyroscope, orientation, position) that
// keeps one value in all of at least kFewest samples, as "gx, gy and gz".
template <class Sample>
std::vector<std::string> FindDead(const Stream& stream, const std::vector<Sample>& samples);

// Channels, from 0, that have one value in all of at least kFewest samples.
std::vector<std::size_t> StillChannels(const std::vector<ChannelsSample>& samples);

}  // namespace trueline
