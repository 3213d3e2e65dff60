// The records of a recording, given to the streams that come from its channels.
#pragma once

#include <map>
#include <vector>

#include "problems/import/formats/recording.h"
#include "problems/import/stream_import.h"

namespace trueline {

// Reads the channels of the streams. Returns for each channel how many of its messages could not be
// decoded.
std::map<std::size_t, std::size_t> ReadChannels(Recording* recording,
                                                const std::vector<StreamImport*>& streams);

}  // namespace trueline
