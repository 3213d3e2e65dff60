// ROS 2 bags: a folder with metadata.yaml and sqlite3 or MCAP files, or one of these files.
#pragma once

#include <filesystem>
#include <vector>

#include "problems/import/formats/recording.h"

namespace trueline {

// Files compressed as a whole (.zstd), compressed messages and the rows of a write-ahead log beside
// an sqlite3 file (.db3-wal) are read too. A file or folder that
// holds no bag throws InputError.
void WalkRosbag2(const std::filesystem::path& path, MessageSink* sink);

// The files of a bag's folder, in order: those that metadata.yaml lists where all are there, else
// all of the folder.
std::vector<std::filesystem::path> Rosbag2Files(const std::filesystem::path& folder);

}  // namespace trueline
