// What is in a recording, for people.
#pragma once

#include <string>

#include "problems/import/formats/recording.h"

namespace trueline {

// A channel's fields with their units, elements of a list together: "q[0..3], x [m]".
std::string FieldList(const Channel& channel);

// Format, and for each channel with records: their number, rate (Hz), span (s), fields.
std::string ListChannels(const Recording& recording);

}  // namespace trueline
