// MCAP (mcap.dev, "Format Specification").
#pragma once

#include <filesystem>

#include "problems/import/formats/recording.h"

namespace trueline {

// Channels are topics; cdr, ros1, json and protobuf messages are decoded. The time of recording is
// the log time. Files that were never closed are read as far as they go; chunks with a wrong CRC
// are left out.
void WalkMcap(const std::filesystem::path& path, MessageSink* sink);

}  // namespace trueline
