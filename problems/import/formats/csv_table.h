// A CSV file of unknown columns, for a list of what is in it.
#pragma once

#include <filesystem>

#include "problems/import/formats/recording.h"

namespace trueline {

// The channel `rows`; the delimiter is that which the header has most of. The time is that of the
// first column whose name starts with t, read as seconds.
void WalkCsv(const std::filesystem::path& path, MessageSink* sink);

char GuessDelimiter(std::string_view line);

}  // namespace trueline
