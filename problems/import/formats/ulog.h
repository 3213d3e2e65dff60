// PX4's ULog, versions 0 and 1 (PX4 User Guide, "ULog File Format").
#pragma once

#include <filesystem>

#include "problems/import/formats/recording.h"

namespace trueline {

// Channels are topics, instances multi ids. Times are since boot: of recording `timestamp`, of
// measurement `timestamp_sample` where the topic has it. After damage the walk goes on at the next
// synchronisation record. Throws InputError for a log with features of a later version.
void WalkULog(const std::filesystem::path& path, MessageSink* sink);

}  // namespace trueline
