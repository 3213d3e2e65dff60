// Logs of lines of numbers: ASL (EuRoC) folders and TUM trajectories.
#pragma once

#include <filesystem>

#include "problems/import/formats/recording.h"

namespace trueline {

// Channels are the sensors, each a folder with data.csv, of `path` or `path`/mav0.
void WalkAsl(const std::filesystem::path& path, MessageSink* sink);
bool IsAsl(const std::filesystem::path& folder);

// The channel `trajectory`: t, tx, ty, tz, qx, qy, qz, qw.
void WalkTum(const std::filesystem::path& path, MessageSink* sink);
// Whether the first lines, comments apart, have `count` numbers with blanks between.
bool HasRowsOf(std::size_t count, std::string_view start);

}  // namespace trueline
