// The streams that the names and numbers of a recording suggest, as lines of a map.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "problems/import/formats/recording.h"

namespace trueline {

struct ProposedVector {
  std::size_t channel;
  std::vector<std::string> columns;
  std::string_view unit;  // as the names state it
};

struct ProposedStreams {
  std::map<std::string, std::string> lines;  // by stream
  bool is_z_up = false;                      // the accelerometer reads about +g along z
  std::vector<ProposedVector> accels, gyros;
  std::string attitude_of_mocap;  // the line that reads it, where there is no other
  std::string velocity;  // the line that reads it, where nothing else says where the vehicle is
};

// Reads the recording again, for the sizes of its numbers.
ProposedStreams ProposeStreams(Recording* recording);

// The line that reads mocap where columns are named as those of a tracker ("vicon_x", "mocap.qw");
// empty without any.
std::string ProposeTracker(Recording* recording);

}  // namespace trueline
