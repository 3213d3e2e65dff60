// Dates and times of day as text.
#pragma once

#include <string_view>

#include "problems/common/time.h"

namespace trueline {

// "2024-05-01T23:59:55.25Z" (ISO 8601, RFC 3339; a blank for the T, a zone as +02:00, and none for
// UTC) to the time since 1970, or "23:59:55.25" to that since midnight. False for any other text.
bool ParseDateTime(std::string_view text, TimeNs* time);

}  // namespace trueline
