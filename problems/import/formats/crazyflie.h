// Logs of the Crazyflie's micro-SD deck, versions 1 and 2 (bitcraze, tools/usdlog/cfusdlog.py).
#pragma once

#include <filesystem>

#include "problems/import/formats/recording.h"

namespace trueline {

// Channels are event types; fields are "group.name". Times are since boot.
void WalkCrazyflie(const std::filesystem::path& path, MessageSink* sink);

// Whether the bytes, the first ones of a file, start such a log.
bool IsCrazyflie(std::string_view start);

}  // namespace trueline
