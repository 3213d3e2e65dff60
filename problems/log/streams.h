// The streams of a native log, each in its own CSV file.
#pragma once

#include <filesystem>

#include "problems/log/flight_log.h"

namespace trueline {

// Reads every stream file that `directory` has into `log`, with digests and warnings. Throws
// InputError as ReadNativeLog() does.
void ReadStreams(const std::filesystem::path& directory, FlightLog* log);

// Numbers are written with as many digits as it takes to read the same double back, times with nine
// decimals. A stream that is empty is not written, and a file of it from before is removed.
void WriteStreams(const FlightLog& log, const std::filesystem::path& directory);

}  // namespace trueline
