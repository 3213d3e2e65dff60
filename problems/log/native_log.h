// Reader and writer of the native log: a directory with log.yaml and one CSV file a stream.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

// Throws InputError naming file, line and remedy for: a missing or empty required stream, missing
// or unsorted stamps, NaN, an unknown unit or key. These give a warning in `warnings`: a truncated
// last line (dropped), unknown columns (ignored), gaps and saturation in the IMU (reported; the
// integrator handles gaps).
FlightLog ReadNativeLog(const std::filesystem::path& directory);

// The same for a log that may lack the IMU where it has motor commands, or positions where it has
// the IMU and motor commands or rotor speeds.
FlightLog ReadCommandLog(const std::filesystem::path& directory);

bool IsNativeLog(const std::filesystem::path& folder);  // by its log.yaml
// Where that is lost, also by the names of imu.csv's columns.
bool HoldsNativeStreams(const std::filesystem::path& folder);
bool HasPositions(const FlightLog& log);  // of any stream
bool ReadsWithoutPositions(const FlightLog& log);
// Throws InputError for a log without.
void RequirePositions(const FlightLog& log, const std::string& directory);
// The end of a sentence about a log without positions.
inline constexpr char kWithoutPositions[] =
    "; trueline calibrate --drive=rotors shows what IMU and rotors tell alone";

// Each file is written under a temporary name and renamed; streams that are empty are not written.
void WriteNativeLog(const FlightLog& log, const std::filesystem::path& directory);

// The file names that a native log can have.
std::vector<std::string> NativeLogFiles();

// The streams of a native log, each in its own CSV file.

// Reads every stream file that `directory` has into `log`, with digests and warnings. Throws
// InputError as ReadNativeLog() does.
void ReadStreams(const std::filesystem::path& directory, FlightLog* log);

// Numbers are written with as many digits as it takes to read the same double back, times with nine
// decimals. A stream that is empty is not written, and a file of it from before is removed.
void WriteStreams(const FlightLog& log, const std::filesystem::path& directory);

// The folder of a native log, for a page that draws it: its own, or of a foreign log a copy while
// this object lives.
class NativeFolder {
 public:
  // Without `wanted` there is no copy.
  NativeFolder(const FlightLog& log, bool wanted);
  ~NativeFolder();
  NativeFolder(const NativeFolder&) = delete;
  NativeFolder& operator=(const NativeFolder&) = delete;

  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_, copy_;
};

// The streams of a log as a table for people.

// One line for each stream that is there: samples, mean rate (Hz), first and last stamp (s), and
// the channel of the foreign log, where one is known.
std::string StreamTable(const FlightLog& log);

}  // namespace trueline
