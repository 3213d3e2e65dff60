// The streams that the names and numbers of a recording suggest, as lines of a map.
#pragma once

#include <map>
#include <string>

#include "problems/import/formats/recording.h"

namespace trueline {

struct ProposedStreams {
  std::map<std::string, std::string> lines;  // by stream
  bool is_z_up = false;                      // the accelerometer reads about +g along z
};

// Reads the recording again, for the sizes of its numbers.
ProposedStreams ProposeStreams(Recording* recording);

}  // namespace trueline
