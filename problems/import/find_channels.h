// The channels of a recording that the streams of a map may be read from.
#pragma once

#include <string>
#include <vector>

#include "problems/import/formats/recording.h"
#include "problems/import/import_map.h"

namespace trueline {

// A stream as one of its alternatives reads it from one of the channels that fit.
struct StreamCandidate {
  StreamMap stream;             // with `channel`, and without `otherwise`
  std::size_t alternative = 0;  // 0: the stream itself, else its place in `otherwise` from 1
  int rank = 0;                 // by `prefer` and `avoid`; the lowest counts first
  std::size_t name = 0;         // place of the channel's name in the map; instances share it
};

// All that have records and every column, in the order of the map; `why` becomes the last error of
// a column. Of a type, the channel with the most messages comes first; of one name, the instance
// with the lowest number.
std::vector<StreamCandidate> FindCandidates(const Recording& recording, const StreamMap& stream,
                                            std::string* why);

// Labels of channels that fit by name or type, and of whose messages none can be decoded.
std::vector<std::string> UndecodableChannels(const Recording& recording, const StreamMap& stream);

}  // namespace trueline
