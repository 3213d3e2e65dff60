// ArduPilot's DataFlash logs (ArduPilot, AP_Logger/README.md and LogStructure.h).
#pragma once

#include <filesystem>

#include "problems/import/formats/recording.h"

namespace trueline {

// Channels are message types, one for each sensor where a column tells sensors apart. Times are
// since boot. Columns are scaled by MULT where the log has it, else by their format letter; TimeUS
// is left in us. After damage the walk goes on at the next record of a known type.
// The same log as text, a record a line: "IMU, 47863347, 0, 0.0007, ...", after lines of FMT.
void WalkDataFlashText(const std::filesystem::path& path, MessageSink* sink);
bool IsDataFlashText(std::string_view start);

void WalkDataFlash(const std::filesystem::path& path, MessageSink* sink);

}  // namespace trueline
