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

// Whether the first lines, comments apart, have 8 numbers with blanks between, of which the first
// rises and the last four are quaternions of norm 1; one row in ten may be damaged.
bool IsTum(std::string_view start);
// Whether they have 12 numbers, of which nine are rotations.
bool IsKitti(std::string_view start);
// Why a text with as many numbers a line is neither; empty for any other text.
std::string WhyNoTrajectory(const std::filesystem::path& path);

}  // namespace trueline
