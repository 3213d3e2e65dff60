// Tables of text that converters write of recordings: one file or several, each with the columns of
// one topic or of several.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "problems/import/formats/recording.h"

namespace trueline {

inline constexpr char kTablesFormat[] = "tables";

// The tables as a recording of the format that their names are of (ulog2csv, PlotJuggler: "ulog" or
// "ros2"; mavlogdump: "dataflash"; Blackbox Explorer and blackbox_decode: "blackbox"; cfclient:
// "crazyflie"), so that the map of that format reads them; else of the format "tables", with a
// channel for each file or topic.
std::unique_ptr<Recording> OpenTables(const std::vector<std::string>& files);

// What a recording of several files is named by; SplitPaths() gives them back.
std::string JoinPaths(const std::vector<std::string>& files);

// `files`, with those of a folder in its place where it holds tables.
std::vector<std::string> TablesIn(const std::vector<std::string>& files);

}  // namespace trueline
