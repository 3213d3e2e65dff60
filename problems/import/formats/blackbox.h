// Betaflight's blackbox, and logs in its encoding such as INDIflight's ("Blackbox Internals").
#pragma once

#include <filesystem>

#include "problems/import/formats/recording.h"

namespace trueline {

// Channels are `main`, `slow` and `gps`; sessions of one file are their instances, of which the
// longest is preferred. Fields are the raw integers; in `main` also, by the header's settings,
// gyro[k] (deg/s), accel[k] (g), throttle[k] (0 to 1), rotor[k] (rad/s) and battery (V). A frame
// that is not followed by the letter of another one is damaged: it and all up to the next I frame
// are left out.
void WalkBlackbox(const std::filesystem::path& path, MessageSink* sink);

}  // namespace trueline
