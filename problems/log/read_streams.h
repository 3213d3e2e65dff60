// The streams of a native log, each from its own CSV file.
#pragma once

#include <filesystem>

#include "problems/log/flight_log.h"

namespace trueline {

// Reads every stream file that `directory` has into `log`, with digests and warnings. Throws
// InputError as ReadNativeLog() does.
void ReadStreams(const std::filesystem::path& directory, FlightLog* log);

}  // namespace trueline
