// Logs of any format, recognised by their content.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "problems/import/formats/recording.h"

namespace trueline {

// Throws InputError, with what to do, if the format is not read here.
std::unique_ptr<Recording> OpenRecording(const std::filesystem::path& path);

inline constexpr char kCsvFormat[] = "csv";

// The format's key by the first bytes; empty for none.
std::string FormatOf(const std::filesystem::path& path);
bool IsTextFormat(const std::string& key);  // of lines of numbers
bool IsTable(const std::string& path);      // a file of such a format

std::string KnownFormats();             // "ulog (PX4 ULog), ..."
bool IsFormat(const std::string& key);  // of a map's `format`

// Betaflight's blackbox, and logs in its encoding such as INDIflight's ("Blackbox Internals").
// Channels are `main`, `slow` and `gps`; sessions of one file are their instances, of which the
// longest is preferred. Fields are the raw integers; in `main` also, by the header's settings,
// gyro[k] (deg/s), accel[k] (g), throttle[k] (0 to 1), rotor[k] (rad/s) and battery (V). A frame
// that is not followed by the letter of another one is damaged: it and all up to the next I frame
// are left out.
void WalkBlackbox(const std::filesystem::path& path, MessageSink* sink);

// Logs of the Crazyflie's micro-SD deck, versions 1 and 2 (bitcraze, tools/usdlog/cfusdlog.py).
// Channels are event types; fields are "group.name". Times are since boot.
void WalkCrazyflie(const std::filesystem::path& path, MessageSink* sink);

// Whether the bytes, the first ones of a file, start such a log.
bool IsCrazyflie(std::string_view start);

// ArduPilot's DataFlash logs (ArduPilot, AP_Logger/README.md and LogStructure.h).
// Channels are message types, one for each sensor where a column tells sensors apart. Times are
// since boot. Columns are scaled by MULT where the log has it, else by their format letter; TimeUS
// is left in us. After damage the walk goes on at the next record of a known type.
void WalkDataFlash(const std::filesystem::path& path, MessageSink* sink);
// The same log as text, a record a line: "IMU, 47863347, 0, 0.0007, ...", after lines of FMT.
void WalkDataFlashText(const std::filesystem::path& path, MessageSink* sink);
bool IsDataFlashText(std::string_view start);

// MCAP (mcap.dev, "Format Specification").
// Channels are topics; cdr, ros1, json and protobuf messages are decoded. The time of recording is
// the log time. Files that were never closed are read as far as they go; chunks with a wrong CRC
// are left out.
void WalkMcap(const std::filesystem::path& path, MessageSink* sink);

// ROS 1 bags, format 2.0 (ros.org, "Bags/Format/2.0").
// Channels are topics. The index is not used, so that bags of a killed recorder (.bag.active) are
// read as far as they go. Messages come in the order of the file. Throws InputError for encrypted
// bags.
void WalkRosbag1(const std::filesystem::path& path, MessageSink* sink);

// ROS 2 bags: a folder with metadata.yaml and sqlite3 or MCAP files, or one of these files.
// Files compressed as a whole (.zstd), compressed messages and the rows of a write-ahead log beside
// an sqlite3 file (.db3-wal) are read too. A file or folder that
// holds no bag throws InputError.
void WalkRosbag2(const std::filesystem::path& path, MessageSink* sink);

// The files of a bag's folder, in order: those that metadata.yaml lists where all are there, else
// all of the folder.
std::vector<std::filesystem::path> Rosbag2Files(const std::filesystem::path& folder);

// PX4's ULog, versions 0 and 1 (PX4 User Guide, "ULog File Format").
// Channels are topics, instances multi ids. Times are since boot: of recording `timestamp`, of
// measurement `timestamp_sample` where the topic has it. After damage the walk goes on at the next
// synchronisation record. Throws InputError for a log with features of a later version.
void WalkULog(const std::filesystem::path& path, MessageSink* sink);

}  // namespace trueline
