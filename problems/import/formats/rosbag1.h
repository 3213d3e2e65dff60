// ROS 1 bags, format 2.0 (ros.org, "Bags/Format/2.0").
#pragma once

#include <filesystem>

#include "problems/import/formats/recording.h"

namespace trueline {

// Channels are topics. The index is not used, so that bags of a killed recorder (.bag.active) are
// read as far as they go. Messages come in the order of the file. Throws InputError for encrypted
// bags.
void WalkRosbag1(const std::filesystem::path& path, MessageSink* sink);

}  // namespace trueline
