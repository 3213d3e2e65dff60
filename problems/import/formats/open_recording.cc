#include "problems/import/formats/open_recording.h"

#include <fmt/format.h>

#include <array>

#include "problems/common/error.h"
#include "problems/import/formats/blackbox_header.h"
#include "problems/import/formats/bytes.h"
#include "problems/import/formats/csv_table.h"
#include "problems/log/csv_text.h"
#include "problems/log/text_file.h"
#include "problems/log/unpacked.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kStartSize = 1 << 16;  // bytes that tell formats apart

// `start` holds the first bytes of a file, and nothing for a folder.
struct KnownFormat {
  LogFormat format;
  bool (*fits)(const fs::path& path, std::string_view start);
};

bool IsText(std::string_view start) { return start.find('\0') == std::string_view::npos; }

// UTF-16 too, which the reader of its lines refuses with the remedy.
bool IsCsv(const fs::path& path, std::string_view start) {
  return !fs::is_directory(path) && !start.empty() && (IsText(start) || IsUtf16(start));
}

constexpr std::array<KnownFormat, 11> kFormats = {{
    {{"ulog", "PX4 ULog", WalkULog},
     [](const fs::path&, std::string_view start) {
       return start.starts_with(std::string_view("ULog\x01\x12\x35", 7));
     }},
    {{"ros1", "ROS 1 bag", WalkRosbag1, RecordOrder::kChunks},
     [](const fs::path&, std::string_view start) { return start.starts_with("#ROSBAG V2.0\n"); }},
    {{"mcap", "MCAP", WalkMcap, RecordOrder::kChunks},
     [](const fs::path&, std::string_view start) { return start.starts_with("\x89MCAP0\r\n"); }},
    {{"ros2", "ROS 2 bag", WalkRosbag2, RecordOrder::kChunks},
     [](const fs::path& path, std::string_view start) {
       return fs::is_directory(path) ? !Rosbag2Files(path).empty()
                                     : start.starts_with("SQLite format 3");
     }},
    {{"dataflash", "ArduPilot DataFlash", WalkDataFlash},
     [](const fs::path&, std::string_view start) {
       return start.starts_with(std::string_view("\xA3\x95\x80", 3));
     }},
    {{"dataflash", "ArduPilot DataFlash as text", WalkDataFlashText},
     [](const fs::path&, std::string_view start) { return IsDataFlashText(start); }},
    {{"blackbox", "Betaflight blackbox", WalkBlackbox},
     [](const fs::path&, std::string_view start) {
       return start.find(kBlackboxStart) != std::string_view::npos;
     }},
    {{"crazyflie", "Crazyflie micro-SD log", WalkCrazyflie},
     [](const fs::path&, std::string_view start) { return IsCrazyflie(start); }},
    {{"asl", "ASL (EuRoC) folder", WalkAsl, RecordOrder::kFiles},
     [](const fs::path& path, std::string_view) { return fs::is_directory(path) && IsAsl(path); }},
    {{"tum", "TUM trajectory", WalkTum},
     [](const fs::path&, std::string_view start) { return IsText(start) && IsTum(start); }},
    {{kCsvFormat, "CSV", WalkCsv}, IsCsv},
}};

void RefuseNative(const fs::path& path) {
  if (!fs::is_regular_file(path / "log.yaml")) return;
  throw ErrorAt(path.string(), 0,
                "is a native log already (it has a log.yaml); give it to the other programs by "
                "--log");
}

// What to do with known formats that are not read.
void RefuseUnread(const std::string& file, std::string_view start) {
  const auto refuse = [&](const std::string& what) { throw ErrorAt(file, 0, what); };
  std::string what = start.starts_with(std::string_view("\x89HDF\r\n\x1a\n", 8))
                         ? "HDF5 (or MAT 7.3)"
                     : start.starts_with("MATLAB 5.0 MAT-file") ? "a MAT file"
                                                                : "";
  for (const char* end : {"npz", "npy", "xlsx", "xls", "ods", "parquet", "feather", "pkl", "pickle",
                          "json", "jsonl"}) {
    if (LowerCase(file).ends_with(fmt::format(".{}", end))) what = end;
  }
  if (!what.empty()) {
    refuse(
        fmt::format("is {}, which is not read; export its streams as CSV with their times", what));
  }
  for (const std::string_view magic : {"7z\xBC\xAF\x27\x1C", "Rar!\x1A\x07"}) {
    if (start.starts_with(magic)) refuse("is an archive that is not read here; unpack it first");
  }
  if (IsText(start) && IsKitti(start)) {
    refuse(
        "holds KITTI poses, which have no times; write them as a TUM trajectory: "
        "t tx ty tz qx qy qz qw");
  }
  const bool packet = start.size() > 8 && start[0] == 0 && start[1] < 16 &&
                      start.substr(8, 32).find_first_of("\xFE\xFD") != std::string_view::npos;
  if (packet || (start.size() > 40 && start.substr(0, 2) == std::string_view("\0\x06", 2))) {
    refuse(
        "looks like a MAVLink telemetry log, which is too slow to integrate; download the "
        "autopilot's own log (.bin or .ulg) of this flight");
  }
}

std::string StartOf(const fs::path& path) {
  return fs::is_directory(Unpacked(path)) ? "" : FirstBytes(path, kStartSize);
}

// Null for none.
const KnownFormat* Recognise(const fs::path& path, std::string_view start) {
  for (const KnownFormat& known : kFormats) {
    if (known.fits(Unpacked(path), start)) return &known;
  }
  return nullptr;
}

}  // namespace

std::unique_ptr<Recording> OpenRecording(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) {
    throw ErrorAt(path.string(), 0, "does not exist; give the path of a recorded log");
  }
  RefuseNative(path);
  const std::string start = StartOf(path);
  RefuseUnread(path.string(), start);
  if (const KnownFormat* known = Recognise(path, start)) {
    return std::make_unique<Recording>(path, known->format);
  }
  throw ErrorAt(path.string(), 0,
                fmt::format("has no format that is read here; these are: {}", KnownFormats()));
}

std::string FormatOf(const fs::path& path) {
  RefuseNative(path);
  const KnownFormat* known = Recognise(path, StartOf(path));
  return known == nullptr ? "" : known->format.key;
}

bool IsTextFormat(const std::string& key) { return key == kCsvFormat || key == "tum"; }

bool IsTable(const std::string& path) {
  std::error_code unknown;
  return fs::is_regular_file(Unpacked(path), unknown) && IsTextFormat(FormatOf(path));
}

std::string KnownFormats() {
  std::string text;
  for (const KnownFormat& known : kFormats) {
    text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", known.format.key, known.format.name);
  }
  return text;
}

bool IsFormat(const std::string& key) {
  if (key == kTablesFormat) return true;
  for (const KnownFormat& known : kFormats) {
    if (key == known.format.key) return true;
  }
  return false;
}

}  // namespace trueline
